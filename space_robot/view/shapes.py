"""What is drawn of a robot: shapes of its file with their meshes, else foil, panels and tubes.

Derived shapes fill the boxes that masses and inertias give: foil on the base, solar cells on flat
bodies and plates. What a robot's file draws is not changed.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Colour, Plate, Visual
from space_robot_model.robot.shapes import BASE_COLOUR, PANEL_COLOUR, drawn_shapes, shapes_of

Array = NDArray[np.float64]

MOST_FACES = 60_000
"""Maximum number of faces of all meshes of a robot: about 0.7 MB of a page."""
FINEST, COARSER = 400.0, 0.8
"""Initial number of grid cells along a mesh's longest edge for merging vertices, and its factor
in the next attempt."""
MOST_BYTES = 500_000_000
"""Limit of a file's size, that of an archive's content included."""
MOST_READ = 2_000_000
"""Limit of vertices, and of faces, of a file."""
FRAME = 0.022
"""Width of the frame's struts relative to the shortest edge of the box."""
INSET = 0.12
"""Depth of the foil below the frame relative to the struts' width."""
FOIL_CELLS, CREASE, FOIL_SEED = 9, 0.012, 1
"""Facets along an edge of the foil, and their depth relative to the shortest edge of the box."""
FLAT = 0.2
"""A box is a panel if its shortest edge is below this share of the next one."""
THICKNESS = 0.02
"""Thickness of a plate of the robot's file, m."""
ABSORBED = 0.5
"""Smallest absorbed share of the light of plates that are drawn with solar cells."""
CELLS = 8
"""Solar cells along the longer edge of a panel."""
MARGIN, SEAM = 0.03, 0.06
"""Margin of a panel without cells relative to its shorter edge, and gap relative to a cell."""
SIDES, SPOKES = 24, 3
"""Facets around a wheel, and its spokes."""
TARGET_COLOUR: Colour = (0.85, 0.38, 0.22, 1.0)
FRAME_COLOUR: Colour = (0.36, 0.38, 0.42, 1.0)
BACK_COLOUR: Colour = (0.70, 0.71, 0.74, 1.0)
CELL_COLOUR: Colour = (0.06, 0.12, 0.34, 1.0)


class Mesh(NamedTuple):
    """A triangle mesh."""

    vertices: Array
    """(V, 3) vertices in the file's unit."""
    faces: NDArray[np.int64]
    """(F, 3) indices of vertices, counterclockwise as seen from outside."""


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
        drawn += panels_of_plates(robot, drawn)
    return Shapes(tuple(drawn), meshes, remarks)


@lru_cache(maxsize=32)
def read_meshes(files: tuple[str, ...], most: int) -> tuple[dict[str, Mesh], tuple[str, ...]]:
    """Read mesh files of any format supported by trimesh.

    Args:
        files: their paths.
        most: maximum number of faces of all files; a file with more than its share is simplified.

    Returns:
        Meshes by file; remarks on files that cannot be drawn or were simplified.
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
        mesh = _mesh(trimesh.load_mesh(file))
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
        a, b, c = faces.T
        faces = faces[(a != b) & (b != c) & (c != a)]
        _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
        simplified = Mesh(vertices / count[:, np.newaxis], faces[np.sort(first)])
        cells *= COARSER
    if not len(simplified.faces):
        raise UnreadableMeshError("no faces are left of it")
    return simplified


def parts_of(shape: Visual) -> list[ShapePart]:
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
    thinnest, next_one, _ = np.sort(size)
    if shape.colour == PANEL_COLOUR and thinnest < FLAT * next_one:
        back, cells = panel(size)
        return [ShapePart("back", back, BACK_COLOUR), ShapePart("cells", cells, CELL_COLOUR)]
    return []


def panels_of_plates(robot: Robot, boxes: Sequence[Visual]) -> Iterator[Visual]:
    """Yield panels for the plates of a robot's file that its derived boxes do not have.

    A file gives the area of a plate and not its outline: it is drawn as a square. Two plates back
    to back are one panel; plates in a box of their body are its own surface.

    Args:
        robot: without visuals.
        boxes: derived shapes of its bodies.
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


def foil(size: Array) -> Mesh:
    """Return a box of creased foil with edges (3,) m; creases go inwards."""
    rng, count = np.random.default_rng(FOIL_SEED), FOIL_CELLS + 1
    line = np.linspace(-0.5, 0.5, count)
    inside = np.pad(np.ones((FOIL_CELLS - 1, FOIL_CELLS - 1)), 1)
    first = (np.arange(FOIL_CELLS)[:, np.newaxis] * count + np.arange(FOIL_CELLS)).reshape(-1)
    corners = np.column_stack([first, first + count, first + count + 1, first + 1])
    squares = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    grids = []
    for axis, side in product(range(3), (1.0, -1.0)):
        u, v = np.meshgrid(line, side * line, indexing="ij")  # its normal is outwards
        along, across = (axis + 1) % 3, (axis + 2) % 3
        grid = np.empty((*u.shape, 3))
        grid[..., along], grid[..., across] = u * size[along], v * size[across]
        depth = CREASE * size.min() * inside * rng.random(u.shape)
        grid[..., axis] = side * (0.5 * size[axis] - depth)
        grids.append(grid.reshape(-1, 3))
    faces = [squares + number * count * count for number in range(len(grids))]
    return Mesh(np.concatenate(grids), np.concatenate(faces))


def frame(size: Array, width: float) -> Mesh:
    """Return struts of a width, m, along the edges (3,) m of a box."""
    struts = []
    for axis, *signs in product(range(3), (0.5, -0.5), (0.5, -0.5)):
        edges = np.full(3, width)
        edges[axis] = size[axis]
        place = np.insert(np.array(signs) * np.delete(size - width, axis), axis, 0.0)
        struts.append(_box(edges, place))
    return _joined(struts)


def panel(size: Array) -> tuple[Mesh, Mesh]:
    """Return a slab with edges (3,) m, and the solar cells on its two large sides."""
    normal = int(np.argmin(size))
    along, across = (normal + 1) % 3, (normal + 2) % 3
    slab = size.copy()
    slab[normal] *= 0.9
    free = size - 2.0 * MARGIN * min(size[along], size[across])
    pitch = max(free[along], free[across]) / CELLS
    gap = np.array([0.5 * SEAM, 1.0 - 0.5 * SEAM])
    counts = [max(1, round(free[axis] / pitch)) for axis in (along, across)]
    u, v = ((np.arange(count)[:, np.newaxis] + gap) / count - 0.5 for count in counts)
    corners = np.empty((2, *counts, 4, 3))
    for k, (i, j) in enumerate(((0, 0), (1, 0), (1, 1), (0, 1))):
        corners[..., k, along] = (free[along] * u[:, i])[:, np.newaxis]
        corners[..., k, across] = free[across] * v[:, j]
    corners[1] = corners[1, :, :, ::-1].copy()
    corners[0, ..., normal], corners[1, ..., normal] = 0.5 * size[normal], -0.5 * size[normal]
    first = 4 * np.arange(2 * counts[0] * counts[1])[:, np.newaxis]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    return _mesh(_box(slab, np.zeros(3))), Mesh(corners.reshape(-1, 3), faces)


def wheel(radius: float, width: float) -> Mesh:
    """Return a wheel about z, m: a rim, a hub and spokes, which make its turning visible."""
    rim, hub = (
        _revolved([(inner, -half), (outer, -half), (outer, half), (inner, half), (inner, -half)])
        for inner, outer, half in (
            (0.72 * radius, radius, 0.5 * width),
            (0.0, 0.26 * radius, 0.6 * width),
        )
    )
    spokes = []
    for angle in 2.0 * np.pi * np.arange(SPOKES) / SPOKES:
        size = np.array([0.62 * radius, 0.16 * radius, 0.5 * width])
        spoke = _box(size, np.array([0.48 * radius, 0.0, 0.0]))
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        spokes.append(spoke.apply_transform(turn))
    return _joined([rim, hub, *spokes])


def cone(base: float, tip: float, height: float) -> Mesh:
    """Return a closed cone or frustum along z; radii at the origin and at the other end, m."""
    return _mesh(_revolved([(0.0, 0.0), (base, 0.0), (tip, height), (0.0, height)]))


def _revolved(section: list[tuple[float, float]]) -> Any:
    """Return a surface of revolution about z; the section goes counterclockwise in (r, z)."""
    from trimesh.creation import revolve

    return revolve(section, sections=SIDES)


def _box(size: Array, middle: Array) -> Any:
    from trimesh.creation import box

    return box(size).apply_translation(middle)


def _joined(parts: list[Any]) -> Mesh:
    from trimesh.util import concatenate

    return _mesh(concatenate(parts))


def _mesh(part: Any) -> Mesh:
    """Return a mesh of trimesh as arrays."""
    vertices = np.asarray(part.vertices, dtype=np.float64)
    return Mesh(vertices, np.asarray(part.faces, dtype=np.int64))
