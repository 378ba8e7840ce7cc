"""Meshes of a robot's file, made small enough for a page."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import InputError
from space_robot_sim.robot import Robot
from space_robot_sim.robot.shapes import drawn_shapes, shapes_of
from space_robot_sim.robot.tree import Visual

Array = NDArray[np.float64]

MOST_FACES = 60_000
"""Of all meshes of a robot: some 0.7 MB of a page."""
FINEST, COARSER = 400.0, 0.8
"""Cells along a mesh's longest edge to which its corners are moved, and how many fewer next."""


class Mesh(NamedTuple):
    """Triangles."""

    vertices: Array
    """(V, 3) in the file's unit."""
    faces: NDArray[np.int64]
    """(F, 3) numbers of vertices."""


class Shapes(NamedTuple):
    """What is drawn of a robot."""

    shapes: tuple[Visual, ...]
    meshes: dict[str, Mesh]
    """By file, of those shapes that are meshes."""
    remarks: tuple[str, ...]
    """What is drawn otherwise than the robot's file has it, a line each."""


def shown_shapes(robot: Robot) -> Shapes:
    """Return the shapes of a robot with their meshes.

    A mesh that cannot be read is left out; a body that has nothing else is drawn from kinematics
    and mass. One of too many faces is drawn with fewer.
    """
    shapes = shapes_of(robot)
    files = dict.fromkeys(shape.mesh for shape in shapes if shape.shape == "mesh")
    share = MOST_FACES // max(1, len(files))
    meshes, remarks = {}, []
    for file in files:
        try:
            whole = read_mesh(file)
        except InputError as error:
            remarks.append(str(error))
            continue
        meshes[file] = simpler(whole, share)
        if len(whole.faces) > share:
            of_all = f"{len(meshes[file].faces)} of its {len(whole.faces)} faces"
            remarks.append(f"{file}: drawn with {of_all}, to keep the page small")
    found = [shape for shape in shapes if shape.shape != "mesh" or shape.mesh in meshes]
    bare = {shape.body for shape in shapes} - {shape.body for shape in found}
    if bare:
        found += [shape for shape in drawn_shapes(robot) if shape.body in bare]
    return Shapes(tuple(found), meshes, tuple(remarks))


@lru_cache(maxsize=128)
def read_mesh(file: str) -> Mesh:
    """Read a mesh file of any format that trimesh reads.

    Raises:
        InputError: it is not there, or cannot be read; in one line.
    """
    import trimesh

    try:
        read = trimesh.load_mesh(file)
        vertices, faces = np.asarray(read.vertices, dtype=np.float64), np.asarray(read.faces)
    except Exception as error:  # of as many kinds as there are formats
        why = str(error).strip().split("\n")[0] or type(error).__name__
        raise InputError(f"mesh {file}: cannot be drawn ({why})") from None
    if not len(faces) or not np.isfinite(vertices).all():
        raise InputError(f"mesh {file}: cannot be drawn (no faces with finite corners)")
    return Mesh(vertices, faces)


def simpler(mesh: Mesh, most: int) -> Mesh:
    """Return a mesh of ``most`` faces or fewer: corners that lie near one another become one."""
    low, size = mesh.vertices.min(axis=0), float(np.ptp(mesh.vertices, axis=0).max())
    cells, found = FINEST, mesh
    while len(found.faces) > most and cells > 1.0:
        at = np.floor((mesh.vertices - low) / size * cells)
        _, number, count = np.unique(at, axis=0, return_inverse=True, return_counts=True)
        number = number.reshape(-1)
        vertices = np.zeros((len(count), 3))
        np.add.at(vertices, number, mesh.vertices)
        faces = number[mesh.faces]
        a, b, c = faces.T
        faces = faces[(a != b) & (b != c) & (c != a)]
        _, first = np.unique(np.sort(faces, axis=1), axis=0, return_index=True)
        found = Mesh(vertices / count[:, np.newaxis], faces[np.sort(first)])
        cells *= COARSER
    return found
