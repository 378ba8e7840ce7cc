"""Meshes made of numbers: foil, frames, solar cells, wheels, nozzles; and unlit binary glTF."""

from __future__ import annotations

import json
import struct
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import Array

Indices = NDArray[np.int64]

FOIL_CELLS, CREASE, FOIL_SEED = 9, 0.012, 1
"""Facets along an edge of the foil, and their depth relative to the shortest edge of the box."""
CELLS = 8
"""Solar cells along the longer edge of a panel."""
MARGIN, SEAM = 0.03, 0.06
"""Margin of a panel without cells relative to its shorter edge, and gap relative to a cell."""
SIDES, SPOKES = 24, 3
"""Facets around a wheel, and its spokes."""
FLOAT, SHORT, INTEGER = 5126, 5123, 5125
"""glTF's component types: float32, uint16, uint32."""
LINES, TRIANGLES = 1, 4
"""glTF's kinds of primitives."""
UNLIT = "KHR_materials_unlit"
NO_LINES = np.empty((0, 2), np.int64)


class Mesh(NamedTuple):
    """A triangle mesh."""

    vertices: Array
    """(V, 3) vertices in the file's unit."""
    faces: Indices
    """(F, 3) indices of vertices, counterclockwise as seen from outside."""


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
        struts.append(_box(edges, np.insert(signs * np.delete(size - width, axis), axis, 0.0)))
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
    return _joined([_box(slab, np.zeros(3))]), Mesh(corners.reshape(-1, 3), faces)


def wheel(radius: float, width: float) -> Mesh:
    """Return a wheel about z, m: a rim, a hub and spokes, which make its turning visible."""
    parts = []
    for inner, outer, half in (
        (0.72 * radius, radius, 0.5 * width),
        (0.0, 0.26 * radius, 0.6 * width),
    ):
        section = [(inner, -half), (outer, -half), (outer, half), (inner, half), (inner, -half)]
        parts.append(_revolved(section))
    for angle in 2.0 * np.pi * np.arange(SPOKES) / SPOKES:
        size = np.array([0.62 * radius, 0.16 * radius, 0.5 * width])
        turn = np.eye(4)
        turn[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        parts.append(_box(size, np.array([0.48 * radius, 0.0, 0.0])).apply_transform(turn))
    return _joined(parts)


def cone(base: float, tip: float, height: float) -> Mesh:
    """Return a closed cone or frustum along z; radii at the origin and at the other end, m."""
    return _joined([_revolved([(0.0, 0.0), (base, 0.0), (tip, height), (0.0, height)])])


def _revolved(section: list[tuple[float, float]]) -> Any:
    """Return a surface of revolution about z; the section goes counterclockwise in (r, z)."""
    from trimesh.creation import revolve

    return revolve(section, sections=SIDES)


def _box(size: Array, middle: Array) -> Any:
    from trimesh.creation import box

    return box(size).apply_translation(middle)


def _joined(parts: list[Any]) -> Mesh:
    from trimesh.util import concatenate

    return mesh_arrays(concatenate(parts))


def mesh_arrays(part: Any) -> Mesh:
    """Return a mesh of trimesh as arrays."""
    vertices = np.asarray(part.vertices, dtype=np.float64)
    return Mesh(vertices, np.asarray(part.faces, dtype=np.int64))


def grid_faces(rings: int, parts: int) -> Indices:
    """Return the triangles (F, 3) between closed rings of vertices, one ring after the other.

    Seen from where the parts of a ring go counterclockwise around the rings before it, so do the
    triangles.
    """
    first = parts * np.arange(rings - 1)[:, np.newaxis]
    this, following = first + np.arange(parts), first + (np.arange(parts) + 1) % parts
    halves = [(this, this + parts, following + parts), (this, following + parts, following)]
    return np.concatenate([np.stack(half, axis=-1).reshape(-1, 3) for half in halves])


def revolved_glb(radii: Array, heights: Array, colours: Array, sides: int) -> bytes:
    """Return a surface of revolution about z with so many ``sides`` as a GLB file.

    ``radii`` and ``heights`` (R,), m, are a section, counterclockwise in (r, z); ``colours``
    (R, 3) or (R, 4) are those of its points.
    """
    angles = np.arange(sides) * (2.0 * np.pi / sides)
    circle = np.column_stack([np.cos(angles), np.sin(angles), np.ones(sides)])
    section = np.column_stack([radii, radii, heights])
    rings = (section[:, np.newaxis] * circle).reshape(-1, 3)
    faces = grid_faces(len(radii), sides)[:, ::-1]
    return unlit_glb(rings, np.repeat(colours, sides, axis=0), faces)


def unlit_glb(vertices: Array, colours: Array, faces: Indices, lines: Indices = NO_LINES) -> bytes:
    """Return a GLB file of triangles and lines whose colours no light changes.

    Args:
        vertices: (V, 3).
        colours: (V, 3) red, green and blue of the vertices as in CSS, from 0 to 1; or (V, 4) with
            their opacity.
        faces: (F, 3) indices of vertices, counterclockwise as seen from outside.
        lines: (L, 2) indices of vertices.
    """
    places = vertices.astype("<f4")
    shades = np.ones((len(colours), 4))
    shades[:, : colours.shape[1]] = colours
    shades[:, :3] = _linear(shades[:, :3])
    kind, width = (SHORT, "<u2") if len(vertices) < 2**16 - 1 else (INTEGER, "<u4")
    parts = [
        (places, FLOAT, "VEC3"),
        (np.round(shades * 65535.0).astype("<u2"), SHORT, "VEC4"),
        (faces.astype(width).reshape(-1), kind, "SCALAR"),
        (lines.astype(width).reshape(-1), kind, "SCALAR"),
    ]
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    data = b""
    for number, (numbers, component, shape) in enumerate(parts):
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": numbers.nbytes})
        accessors.append(
            {"bufferView": number, "componentType": component, "count": len(numbers), "type": shape}
        )
        data += _padded(numbers.tobytes(), b"\0")
    accessors[0] |= {"min": places.min(axis=0).tolist(), "max": places.max(axis=0).tolist()}
    accessors[1]["normalized"] = True
    attributes = {"POSITION": 0, "COLOR_0": 1}
    primitives = [
        {"attributes": attributes, "indices": indices, "mode": mode, "material": 0}
        for indices, mode in ((2, TRIANGLES), (3, LINES))
        if accessors[indices]["count"]
    ]
    blending = {} if (shades[:, 3] == 1.0).all() else {"alphaMode": "BLEND"}
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [UNLIT],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": [{"extensions": {UNLIT: {}}, **blending}],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    text = _padded(json.dumps(document, separators=(",", ":")).encode(), b" ")
    chunks = b"".join(
        struct.pack("<I4s", len(content), name) + content
        for name, content in ((b"JSON", text), (b"BIN\0", data))
    )
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _padded(content: bytes, filler: bytes) -> bytes:
    return content + filler * (-len(content) % 4)


def _linear(colours: Array) -> Array:
    """Return colours of CSS (sRGB) as the linear ones of glTF."""
    low = colours / 12.92
    return np.where(colours <= 0.04045, low, ((colours + 0.055) / 1.055) ** 2.4)
