"""Meshes of a robot's file, simplified for a page."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Visual
from space_robot_model.robot.shapes import drawn_shapes, shapes_of

from .mesh import Mesh, UnreadableMeshError, check_drawable, read_mesh, simplify
from .spacecraft import panels_of_plates

MOST_FACES = 60_000
"""Maximum number of faces of all meshes of a robot: about 0.7 MB of a page."""


class ReadMesh(NamedTuple):
    """A mesh to be drawn, or the reason why the file cannot be drawn."""

    mesh: Mesh | None
    whole: int = 0
    """Number of faces in the file."""
    reason: str = ""


class Shapes(NamedTuple):
    """Drawn shapes of a robot."""

    shapes: tuple[Visual, ...]
    meshes: dict[str, Mesh]
    """Meshes by file."""
    remarks: tuple[str, ...]
    """Differences from the robot's file, a line each."""


def shown_shapes(robot: Robot) -> Shapes:
    """Return the shapes of a robot with their meshes.

    A mesh that is unreadable or has no file is omitted; a body without other shapes is drawn from
    kinematics and mass. A mesh with too many faces is simplified. Plates of the file are added to
    derived shapes.
    """
    shapes = shapes_of(robot)
    files = tuple(dict.fromkeys(shape.mesh for shape in shapes if shape.mesh))
    meshes, remarks = {}, []
    for file, read in zip(files, read_meshes(files, MOST_FACES), strict=True):
        if read.mesh is None:
            remarks.append(f"mesh {file}: cannot be drawn ({read.reason})")
            continue
        meshes[file] = read.mesh
        if len(read.mesh.faces) < read.whole:
            of_all = f"{len(read.mesh.faces)} of its {read.whole} faces"
            remarks.append(f"{file}: drawn with {of_all}, to keep the page small")
    drawn = [shape for shape in shapes if shape.shape != "mesh" or shape.mesh in meshes]
    bare = {shape.body for shape in shapes} - {shape.body for shape in drawn}
    if bare:
        drawn += [shape for shape in drawn_shapes(robot) if shape.body in bare]
    if not robot.visuals:
        drawn += panels_of_plates(robot, drawn)
    return Shapes(tuple(drawn), meshes, tuple(remarks))


@lru_cache(maxsize=32)
def read_meshes(files: tuple[str, ...], most: int) -> tuple[ReadMesh, ...]:
    """Read mesh files of any format supported by trimesh.

    Args:
        files: their paths.
        most: maximum number of faces of all files; a file with more than its share is simplified.
    """
    read = []
    for file in files:
        try:
            whole = read_mesh(file)
            shown = simplify(whole, most // len(files))
            check_drawable(shown)
            read.append(ReadMesh(shown, len(whole.faces)))
        except UnreadableMeshError as error:
            read.append(ReadMesh(None, reason=str(error)))
    return tuple(read)
