"""Triangle meshes and their simplification."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FINEST, COARSER = 400.0, 0.8
"""Initial number of grid cells along a mesh's longest edge for merging vertices, and its factor
in the next attempt."""


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
