"""What is drawn of a robot: shapes of its file with their meshes, else foil, panels and tubes.

Derived shapes fill the boxes that masses and inertias give: foil on the base, solar cells on flat
bodies and plates. What a robot's file draws keeps its form, and its colour if it has one.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Colour, Plate, Visual
from space_robot_model.robot.placements import base_axes, body_frames
from space_robot_model.robot.shapes import (
    BASE_COLOUR,
    LINK_COLOUR,
    PANEL_COLOUR,
    drawn_shapes,
    shapes_of,
)

from .meshes import Mesh, foil, frame, mesh_arrays, panel

MOST_FACES = 60_000
"""Maximum number of faces of all meshes of a robot: about 0.7 MB of a page."""
FINEST, COARSER = 400.0, 0.8
"""Initial number of grid cells along a mesh's longest edge for merging vertices, and its factor
in the next attempt."""
MOST_BYTES, MOST_READ = 500_000_000, 2_000_000
"""Limit of a file's size, that of an archive's content included; of its vertices, and faces."""
FRAME, INSET = 0.022, 0.12
"""Width of the frame's struts relative to the shortest edge of the box, and depth of the foil
below the frame relative to that width."""
FLAT = 0.2
"""A box is a panel if its shortest edge is below this share of the next one."""
THICKNESS = 0.02
"""Thickness of a plate of the robot's file, m."""
ABSORBED = 0.5
"""Smallest absorbed share of the light of plates that are drawn with solar cells."""
SMALLEST = 0.1
"""Size of a base without shapes, m."""
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
TARGET_COLOUR: Colour = (0.85, 0.38, 0.22, 1.0)
FRAME_COLOUR: Colour = (0.36, 0.38, 0.42, 1.0)
BACK_COLOUR: Colour = (0.70, 0.71, 0.74, 1.0)
CELL_COLOUR: Colour = (0.06, 0.12, 0.34, 1.0)


class ShapePart(NamedTuple):
    """A mesh of one colour, in the axes of its shape."""

    name: str
    mesh: Mesh
    colour: Colour


class Shapes(NamedTuple):
    """Drawn shapes of a robot."""

    shapes: tuple[Visual, ...]
    meshes: dict[str, Mesh]
    """Meshes by file."""
    remarks: tuple[str, ...]
    """Differences from the robot's file, a line each."""


class UnreadableMeshError(Exception):
    """A file cannot be drawn; the message has the reason."""


def shown_shapes(robot: Robot) -> Shapes:
    """Return the shapes of a robot with their meshes.

    A mesh that is unreadable or has no file is omitted; a body without other shapes is drawn from
    kinematics and mass. A mesh with too many faces is simplified. Plates of the file are added to
    derived shapes.
    """
    shapes = shapes_of(robot)
    files = tuple(dict.fromkeys(shape.mesh for shape in shapes if shape.mesh))
    meshes, remarks = read_meshes(files, MOST_FACES)
    drawn = [shape for shape in shapes if shape.shape != "mesh" or shape.mesh in meshes]
    bare = {shape.body for shape in shapes} - {shape.body for shape in drawn}
    if bare:
        drawn += [shape for shape in drawn_shapes(robot) if shape.body in bare]
    if not robot.visuals:
        drawn += plate_panels(robot, drawn)
    coloured = (shape if shape.colour else _coloured(shape, robot.n) for shape in drawn)
    return Shapes(tuple(coloured), meshes, remarks)


def _coloured(shape: Visual, joints: int) -> Visual:
    """Return a shape without a colour as metal on arms, else as solar cells or foil."""
    if 0 < shape.body <= joints:
        return replace(shape, colour=LINK_COLOUR)
    is_panel = shape.body or _is_flat(shape)
    return replace(shape, colour=PANEL_COLOUR if is_panel else BASE_COLOUR)


def _is_flat(shape: Visual) -> bool:
    thinnest, *others = sorted(shape.size)
    return shape.shape == "box" and thinnest < FLAT * others[0]


@lru_cache(maxsize=32)
def read_meshes(files: tuple[str, ...], most: int) -> tuple[dict[str, Mesh], tuple[str, ...]]:
    """Return meshes by file, and remarks on files that cannot be drawn or were simplified.

    ``most`` is the maximum number of faces of all files, which have equal shares of it.
    """
    meshes, remarks = dict[str, Mesh](), []
    for file in files:
        try:
            whole = read_mesh(file)
            meshes[file] = shown = simplify(whole, most // len(files))
        except UnreadableMeshError as error:
            remarks.append(f"mesh {file}: cannot be drawn ({error})")
            continue
        if len(shown.faces) < len(whole.faces):
            share = f"{len(shown.faces)} of its {len(whole.faces)} faces"
            remarks.append(f"{file}: drawn with {share}, to keep the page small")
    return meshes, tuple(remarks)


def read_mesh(file: str) -> Mesh:
    """Read a mesh file of any format supported by trimesh.

    Raises:
        UnreadableMeshError: the file cannot be drawn, or is too large.
    """
    import trimesh

    path = Path(file)
    if not path.is_file():
        raise UnreadableMeshError("not a file" if path.exists() else "no such file")
    size = path.stat().st_size
    if zipfile.is_zipfile(path):
        with zipfile.ZipFile(path) as archive:
            size = sum(info.file_size for info in archive.infolist())
    if size > MOST_BYTES:
        limit = f"at most {MOST_BYTES / 1e6:g} MB are allowed"
        raise UnreadableMeshError(f"has {size / 1e6:.3g} MB, {limit}")
    try:
        mesh = mesh_arrays(trimesh.load_mesh(file))
    except Exception as error:  # every format has its own types
        reason = str(error).strip().split("\n")[0] or type(error).__name__
        raise UnreadableMeshError(reason) from None
    for count, name in ((len(mesh.vertices), "vertices"), (len(mesh.faces), "faces")):
        if count > MOST_READ:
            raise UnreadableMeshError(f"{count} {name}, at most {MOST_READ} are allowed")
    if not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
        raise UnreadableMeshError("no faces with finite corners")
    return mesh


def simplify(mesh: Mesh, most: int) -> Mesh:
    """Return a mesh of at most ``most`` faces, by merging the vertices in each cell of a grid.

    Raises:
        UnreadableMeshError: no face is left.
    """
    low, size = mesh.vertices.min(axis=0), float(np.ptp(mesh.vertices, axis=0).max()) or 1.0
    cells, simplified = FINEST, mesh
    while len(simplified.faces) > most and cells > 1.0:
        at = np.floor((mesh.vertices - low) / size * cells)
        _, number, count = np.unique(at, axis=0, return_inverse=True, return_counts=True)
        number = number.reshape(-1)
        vertices = np.zeros((len(count), 3))
        np.add.at(vertices, number, mesh.vertices)
        faces = number[mesh.faces]
        faces = faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
        _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
        simplified = Mesh(vertices / count[:, np.newaxis], faces[np.sort(first)])
        cells *= COARSER
    if not len(simplified.faces):
        raise UnreadableMeshError("no faces are left of it")
    return simplified


def drawn_parts(shape: Visual) -> list[ShapePart]:
    """Return what a box in one of the colours of derived shapes is drawn as; empty: as it is."""
    if shape.shape != "box" or shape.colour is None:
        return []
    size = np.array(shape.size)
    if shape.colour in (BASE_COLOUR, TARGET_COLOUR):
        width = FRAME * float(size.min())
        return [
            ShapePart("foil", foil(size - 2.0 * INSET * width), shape.colour),
            ShapePart("frame", frame(size, width), FRAME_COLOUR),
        ]
    if shape.colour == PANEL_COLOUR and _is_flat(shape):
        back, cells = panel(size)
        return [ShapePart("back", back, BACK_COLOUR), ShapePart("cells", cells, CELL_COLOUR)]
    return []


def plate_panels(robot: Robot, boxes: Sequence[Visual]) -> Iterator[Visual]:
    """Yield panels for the plates of a robot's file that its derived boxes do not have.

    A file gives the area of a plate and not its outline: it is drawn as a square. Two plates back
    to back are one panel; plates in a box of their body are its own surface.
    """
    drawn: list[Plate] = []
    for plate in robot.plates:
        if any(_is_in(plate, box) for box in boxes if box.body == plate.body):
            continue
        if any(_are_one(plate, other) for other in drawn):
            continue
        drawn.append(plate)
        edge, z = float(np.sqrt(plate.area)), plate.normal
        x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
        x /= np.linalg.norm(x)
        absorbed = 1.0 - plate.specular - plate.diffuse
        yield Visual(
            "box",
            (edge, edge, THICKNESS),
            np.column_stack((x, np.cross(z, x), z)),
            plate.centre,
            colour=PANEL_COLOUR if absorbed >= ABSORBED - 1e-9 else BACK_COLOUR,
            body=plate.body,
        )


def _is_in(plate: Plate, box: Visual) -> bool:
    place = box.rotation.T @ (plate.centre - box.position)
    return box.shape == "box" and bool((np.abs(place) <= 0.51 * np.array(box.size)).all())


def _are_one(plate: Plate, other: Plate) -> bool:
    return (
        plate.body == other.body
        and bool(plate.normal @ other.normal < -0.999)
        and bool(np.linalg.norm(plate.centre - other.centre) < 2.0 * THICKNESS)
    )


class BoundingBox(NamedTuple):
    """The box around a drawn shape, on the axes of the shape."""

    shape: Visual
    middle: Array
    """(3,) m, in the frame of the shape's body."""
    half: Array
    """(3,) half edges, m."""

    @property
    def corners(self) -> Array:
        """(8, 3) m, in the frame of the shape's body."""
        return np.asarray(self.middle + (CORNERS * self.half) @ self.shape.rotation.T)


def bounding_boxes(robot: Robot) -> list[BoundingBox]:
    """Return the boxes around the drawn shapes of a robot."""
    drawn, boxes = shown_shapes(robot), []
    for shape in drawn.shapes:
        size, middle = np.array(shape.size), np.zeros(3)
        if (mesh := drawn.meshes.get(shape.mesh)) is not None:
            ends = np.array([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)]) * size
            middle, half = ends.mean(axis=0), 0.5 * np.ptp(ends, axis=0)
        elif shape.shape == "box":
            half = 0.5 * size
        elif shape.shape == "cylinder":
            half = np.array([size[0], size[0], 0.5 * size[1]])
        else:
            half = np.full(3, size[0])
        boxes.append(BoundingBox(shape, shape.position + shape.rotation @ middle, half))
    return boxes


def extent(robot: Robot, position: Array, quaternion: Array, joint_positions: Array) -> Array:
    """Return the corners of a robot's shapes in some poses, (K, 3) m, inertial frame.

    Position (T, 3), m, and quaternion (T, 4) are the base's, positions (T, N), rad or m, those of
    all joints.
    """
    frames = {f.body: f for f in body_frames(robot, base_axes(quaternion.T), joint_positions.T)}
    corners = []
    for box in bounding_boxes(robot):
        frame = frames[box.shape.body]
        for corner in box.corners:
            corners.append(position + (frame.origin + frame.on_outer_axes(corner)).T)
    return np.concatenate(corners)


def base_reach(robot: Robot) -> float:
    """Return the largest distance, m, of the base's shapes from its frame's origin; 0 without."""
    corners = [box.corners for box in bounding_boxes(robot) if box.shape.body == 0]
    return float(np.linalg.norm(np.concatenate(corners), axis=1).max()) if corners else 0.0


class BaseSurface:
    """The surface of a robot's base, base frame."""

    def __init__(self, robot: Robot) -> None:
        # derived tubes and panels are on the base
        self._boxes = [
            box
            for box in bounding_boxes(robot)
            if not box.shape.body and (robot.visuals or box.shape.colour == BASE_COLOUR)
        ]

    @property
    def size(self) -> float:
        """Mean edge of the largest box, m."""
        return max((float(np.mean(2.0 * box.half)) for box in self._boxes), default=SMALLEST)

    def distance(self, start: Array, direction: Array) -> float:
        """Return how far it is from a point (3,), m, along a unit vector until the last box ends.

        It is 0 if no box is there.
        """
        farthest = 0.0
        for shape, middle, half in self._boxes:
            place, along = shape.rotation.T @ (start - middle), shape.rotation.T @ direction
            with np.errstate(divide="ignore", invalid="ignore"):
                sides = np.array([(-half - place) / along, (half - place) / along])
            # along a side the ray is between its planes, or never inside
            still = along == 0.0
            if (np.abs(place) > half)[still].any():
                continue
            entry = float(sides.min(axis=0)[~still].max())
            leaving = float(sides.max(axis=0)[~still].min())
            if leaving >= max(entry, 0.0):
                farthest = max(farthest, leaving)
        return farthest

    def nearest(self, place: Array) -> Array:
        """Return the nearest point to a place, (3,) m; a place in a box, or without one, itself."""
        points = [
            middle + shape.rotation @ np.clip(shape.rotation.T @ (place - middle), -half, half)
            for shape, middle, half in self._boxes
        ]
        return min(points, key=lambda p: float(np.linalg.norm(p - place)), default=place)
