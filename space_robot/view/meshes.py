"""Meshes of a robot's file, simplified for a page."""

from __future__ import annotations

import json
import subprocess
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from space_robot_model.robot import Robot
from space_robot_model.robot.shapes import drawn_shapes, shapes_of
from space_robot_model.robot.tree import Visual
from space_robot_msgs_py.ros.run_module import clean_environment, module_command

from . import mesh_process
from .mesh import Mesh
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
    """Read mesh files of any format supported by trimesh, in processes with limits.

    Args:
        files: their paths.
        most: maximum number of faces of all files; a file with more than its share is simplified.
    """
    read: list[ReadMesh] = []
    while len(read) < len(files):  # a process ends at a file that exceeds the limits
        read += _read_in_process(files[len(read) :], most // len(files))
    return tuple(read)


def _read_in_process(files: tuple[str, ...], most: int) -> list[ReadMesh]:
    """Read files until the process ends; return at least one result."""
    # one BLAS thread: each thread would reserve memory, and BLAS is not used
    environment = {**clean_environment(), "OPENBLAS_NUM_THREADS": "1"}
    read: list[ReadMesh] = []
    with TemporaryDirectory() as folder:
        subprocess.run(
            module_command(mesh_process.__name__, str(most), folder),
            env=environment,
            input=json.dumps(files).encode(),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            check=False,
        )
        for number in range(len(files)):
            result = Path(folder) / f"{number}.npz"
            reason = result.with_suffix(".txt")
            if result.is_file():
                with np.load(result) as data:
                    mesh = Mesh(data["vertices"], data["faces"])
                    read.append(ReadMesh(mesh, int(data["whole"])))
            elif reason.is_file():
                read.append(ReadMesh(None, reason=reason.read_text("utf-8")))
            else:
                return [*read, ReadMesh(None, reason=mesh_process.TOO_MUCH)]
    return read
