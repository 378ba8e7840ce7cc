"""Meshes of a spacecraft's parts: foil, frame, solar cells, wheels."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from .glb import grid_faces
from .mesh import Mesh

Array = NDArray[np.float64]

FOIL_CELLS, CREASE, FOIL_SEED = 9, 0.012, 1
"""Facets along an edge of the foil, and their depth relative to the shortest edge of the box."""
CELLS = 8
"""Solar cells along the longer edge of a panel."""
MARGIN, SEAM = 0.03, 0.06
"""Margin of a panel without cells relative to its shorter edge, and gap relative to a cell."""
NEXT = (1, 2, 0)
SIDES = 24
"""Facets around a wheel."""
SPOKES = 3


def foil(size: Array) -> Mesh:
    """Return a box of creased foil; creases go inwards.

    Args:
        size: (3,) edges, m.
    """
    rng = np.random.default_rng(FOIL_SEED)
    line = np.linspace(-0.5, 0.5, FOIL_CELLS + 1)
    inside = np.pad(np.ones((FOIL_CELLS - 1, FOIL_CELLS - 1)), 1)
    vertices: list[Array] = []
    faces: list[NDArray[np.int64]] = []
    for axis in range(3):
        for side in (1.0, -1.0):
            u, v = np.meshgrid(line, side * line, indexing="ij")  # its normal is outwards
            grid = np.empty((*u.shape, 3))
            grid[..., NEXT[axis]] = u * size[NEXT[axis]]
            grid[..., NEXT[NEXT[axis]]] = v * size[NEXT[NEXT[axis]]]
            depth = CREASE * size.min() * inside * rng.random(u.shape)
            grid[..., axis] = side * (0.5 * size[axis] - depth)
            faces.append(_squares(FOIL_CELLS, FOIL_CELLS) + sum(len(part) for part in vertices))
            vertices.append(grid.reshape(-1, 3))
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


def _squares(rows: int, columns: int) -> NDArray[np.int64]:
    """Return the triangles of a grid of (rows + 1) times (columns + 1) vertices."""
    first = (np.arange(rows)[:, np.newaxis] * (columns + 1) + np.arange(columns)).reshape(-1)
    along, across = first + columns + 1, first + 1
    return np.concatenate(
        [np.column_stack([first, along, along + 1]), np.column_stack([first, along + 1, across])]
    )


def frame(size: Array, width: float) -> Mesh:
    """Return struts along the edges of a box.

    Args:
        size: (3,) edges of the box, m.
        width: of the struts, m.
    """
    struts = []
    for axis in range(3):
        edges = np.full(3, width)
        edges[axis] = size[axis]
        for a in (0.5, -0.5):
            for b in (0.5, -0.5):
                place = np.zeros(3)
                place[NEXT[axis]] = a * (size[NEXT[axis]] - width)
                place[NEXT[NEXT[axis]]] = b * (size[NEXT[NEXT[axis]]] - width)
                struts.append(box_mesh(edges, place))
    return merged(struts)


def panel(size: Array) -> tuple[Mesh, Mesh]:
    """Return a slab, and the solar cells on its two large sides.

    Args:
        size: (3,) edges, m.
    """
    normal = int(np.argmin(size))
    u, v = NEXT[normal], NEXT[NEXT[normal]]
    slab = size.copy()
    slab[normal] *= 0.9
    free = size - 2.0 * MARGIN * min(size[u], size[v])
    pitch = max(free[u], free[v]) / CELLS
    rows, columns = (max(1, round(free[axis] / pitch)) for axis in (u, v))
    corners = []
    for side in (1.0, -1.0):
        for i in range(rows):
            for j in range(columns):
                low = np.array([i / rows, j / columns]) - 0.5
                step = np.array([1.0 / rows, 1.0 / columns])
                gap = 0.5 * SEAM * step
                start, stop = low + gap, low + step - gap
                order = [(start[0], start[1]), (stop[0], start[1]), stop, (start[0], stop[1])]
                for a, b in order if side > 0.0 else order[::-1]:
                    corner = np.empty(3)
                    corner[u], corner[v], corner[normal] = a * free[u], b * free[v], side
                    corner[normal] *= 0.5 * size[normal]
                    corners.append(corner)
    first = 4 * np.arange(len(corners) // 4)[:, np.newaxis]
    cells = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    return box_mesh(slab, np.zeros(3)), Mesh(np.array(corners), cells)


def box_mesh(size: Array, middle: Array) -> Mesh:
    """Return a box as a mesh, with its faces outwards.

    Args:
        size: (3,) edges, m.
        middle: (3,) m.
    """
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [half for a, b, c, d in quads for half in ((a, b, c), (a, c, d))]
    return Mesh(middle + 0.5 * signs * size, np.array(faces))


def merged(meshes: list[Mesh]) -> Mesh:
    """Return several meshes as one."""
    first = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    return Mesh(
        np.concatenate([mesh.vertices for mesh in meshes]),
        np.concatenate([mesh.faces + start for mesh, start in zip(meshes, first, strict=False)]),
    )


def wheel(radius: float, width: float) -> Mesh:
    """Return a wheel about z: a rim, a hub and spokes, which make its turning visible.

    Args:
        radius: m.
        width: along the axis, m.
    """
    parts = [_ring(0.72 * radius, radius, width), _ring(0.0, 0.26 * radius, 1.2 * width)]
    for k in range(SPOKES):
        angle = 2.0 * np.pi * k / SPOKES
        cosine, sine = np.cos(angle), np.sin(angle)
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        size = np.array([0.62 * radius, 0.16 * radius, 0.5 * width])
        spoke = box_mesh(size, np.array([0.48 * radius, 0.0, 0.0]))
        parts.append(Mesh(spoke.vertices @ turn.T, spoke.faces))
    return merged(parts)


def _ring(inner: float, outer: float, width: float) -> Mesh:
    """Return a closed ring about z with a rectangular section."""
    radii = np.array([inner, outer, outer, inner, inner])
    heights = 0.5 * width * np.array([-1.0, -1.0, 1.0, 1.0, -1.0])
    return _turned(radii, heights)


def cone(base: float, tip: float, height: float) -> Mesh:
    """Return a closed cone or frustum along z from the origin.

    Args:
        base: radius at the origin, m.
        tip: radius at the other end, m.
        height: m.
    """
    return _turned(np.array([0.0, base, tip, 0.0]), np.array([0.0, 0.0, height, height]))


def _turned(radii: Array, heights: Array) -> Mesh:
    """Return a surface of revolution about z; the section goes counterclockwise in (r, z)."""
    angles = np.arange(SIDES) * (2.0 * np.pi / SIDES)
    rings = np.empty((len(radii), SIDES, 3))
    rings[..., 0] = radii[:, np.newaxis] * np.cos(angles)
    rings[..., 1] = radii[:, np.newaxis] * np.sin(angles)
    rings[..., 2] = heights[:, np.newaxis]
    return Mesh(rings.reshape(-1, 3), grid_faces(len(radii), SIDES)[:, ::-1])
