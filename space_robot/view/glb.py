"""Binary glTF of triangles and lines with colours of their own, which no light changes."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

FLOAT, SHORT, INTEGER = 5126, 5123, 5125
"""glTF's component types: float32, uint16, uint32."""
VERTICES, INDICES = 34962, 34963
"""glTF's targets of buffers."""
LINES, TRIANGLES = 1, 4
"""glTF's kinds of primitives."""


NO_LINES = np.empty((0, 2), np.int64)


def unlit_glb(vertices: Array, colours: Array, faces: Indices, lines: Indices = NO_LINES) -> bytes:
    """Return the content of a GLB file.

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
    is_opaque = bool((shades[:, 3] == 1.0).all())
    kind, width = (SHORT, "<u2") if len(vertices) < 2**16 - 1 else (INTEGER, "<u4")
    parts = [
        (places, FLOAT, "VEC3", VERTICES),
        (np.round(shades * 65535.0).astype("<u2"), SHORT, "VEC4", VERTICES),
        (faces.astype(width).reshape(-1), kind, "SCALAR", INDICES),
        (lines.astype(width).reshape(-1), kind, "SCALAR", INDICES),
    ]
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []
    data = bytearray()
    for number, (numbers, component, shape, target) in enumerate(parts):
        content = numbers.tobytes()
        views.append(
            {"buffer": 0, "byteOffset": len(data), "byteLength": len(content), "target": target}
        )
        accessors.append(
            {"bufferView": number, "componentType": component, "count": len(numbers), "type": shape}
        )
        data += content + bytes(-len(content) % 4)
    accessors[0] |= {"min": places.min(axis=0).tolist(), "max": places.max(axis=0).tolist()}
    accessors[1]["normalized"] = True
    attributes = {"POSITION": 0, "COLOR_0": 1}
    primitives = [
        {"attributes": attributes, "indices": indices, "mode": mode, "material": 0}
        for indices, mode in ((2, TRIANGLES), (3, LINES))
        if accessors[indices]["count"]
    ]
    unlit = "KHR_materials_unlit"
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": [unlit],
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": primitives}],
        "materials": [{"extensions": {unlit: {}}} | ({} if is_opaque else {"alphaMode": "BLEND"})],
        "buffers": [{"byteLength": len(data)}],
        "bufferViews": views,
        "accessors": accessors,
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = _chunk(b"JSON", text) + _chunk(b"BIN\0", bytes(data))
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


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
    """Return a surface of revolution about z as a GLB file.

    Args:
        radii: (R,) of the section, counterclockwise in (r, z), m.
        heights: (R,) of the same, m.
        colours: (R, 3) or (R, 4) of its points.
        sides: facets around z.
    """
    angles = np.arange(sides) * (2.0 * np.pi / sides)
    rings = np.empty((len(radii), sides, 3))
    rings[..., 0] = radii[:, np.newaxis] * np.cos(angles)
    rings[..., 1] = radii[:, np.newaxis] * np.sin(angles)
    rings[..., 2] = heights[:, np.newaxis]
    faces = grid_faces(len(radii), sides)[:, ::-1]
    return unlit_glb(rings.reshape(-1, 3), np.repeat(colours, sides, axis=0), faces)


def _chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack("<I4s", len(content), kind) + content


def _linear(colours: Array) -> Array:
    """Return colours of CSS (sRGB) as the linear ones of glTF."""
    low = colours / 12.92
    return np.where(colours <= 0.04045, low, ((colours + 0.055) / 1.055) ** 2.4)
