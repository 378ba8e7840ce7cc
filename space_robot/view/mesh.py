"""Triangle meshes: their files, with limits of size, and their simplification."""

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FINEST, COARSER = 400.0, 0.8
"""Initial number of grid cells along a mesh's longest edge for merging vertices, and its factor
in the next attempt."""
MOST_BYTES = 500_000_000
"""Limit of a file's size, that of an archive's content included."""
MOST_READ = 2_000_000
"""Limit of vertices, and of faces, of a file."""


class Mesh(NamedTuple):
    """A triangle mesh."""

    vertices: Array
    """(V, 3) vertices in the file's unit."""
    faces: NDArray[np.int64]
    """(F, 3) indices of vertices."""


def simplify(mesh: Mesh, most: int) -> Mesh:
    """Return a mesh of at most ``most`` faces, by merging the vertices in each cell of a grid."""
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
    return simplified


class UnreadableMeshError(Exception):
    """A file cannot be drawn; the message has the reason."""


def read_mesh(file: str) -> Mesh:
    """Read a mesh file of any format supported by trimesh.

    Raises:
        UnreadableMeshError: the file cannot be drawn, or is too large.
    """
    import trimesh

    path = Path(file)
    if not path.is_file():
        raise UnreadableMeshError("not a file" if path.exists() else "no such file")
    _check_size(path)
    try:
        read = trimesh.load_mesh(file)
        vertices, faces = np.asarray(read.vertices, dtype=np.float64), np.asarray(read.faces)
    except Exception as error:  # every format has its own types
        reason = str(error).strip().split("\n")[0] or type(error).__name__
        raise UnreadableMeshError(reason) from None
    for count, name in ((len(vertices), "vertices"), (len(faces), "faces")):
        if count > MOST_READ:
            raise UnreadableMeshError(f"{count} {name}, at most {MOST_READ} are allowed")
    mesh = Mesh(vertices, faces)
    check_drawable(mesh)
    return mesh


def check_drawable(mesh: Mesh) -> None:
    """Check that a mesh can be drawn.

    Raises:
        UnreadableMeshError: there are no faces, or vertices that are not finite.
    """
    if not len(mesh.faces) or not np.isfinite(mesh.vertices).all():
        raise UnreadableMeshError("no faces with finite corners")


def _check_size(file: Path) -> None:
    """Check the size of a file, and the unpacked size that an archive states.

    Raises:
        UnreadableMeshError: the size is too large.
    """
    size = file.stat().st_size
    if zipfile.is_zipfile(file):
        with zipfile.ZipFile(file) as archive:
            size = sum(info.file_size for info in archive.infolist())
    if size > MOST_BYTES:
        raise UnreadableMeshError(
            f"has {size / 1e6:.3g} MB, at most {MOST_BYTES / 1e6:g} MB are allowed"
        )
