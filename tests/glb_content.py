"""Triangles and lines of a GLB file, read as the standard of glTF 2.0 says."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

TYPES = {5126: "<f4", 5123: "<u2", 5125: "<u4"}
COLUMNS = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


class GlbContent:
    """Content of a GLB file with one mesh."""

    def __init__(self, data: bytes) -> None:
        magic, version, length = struct.unpack("<4sII", data[:12])
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size, kind = struct.unpack("<I4s", data[12:20])
        assert kind == b"JSON"
        self.document: dict[str, Any] = json.loads(data[20 : 20 + size])
        rest, kind = struct.unpack("<I4s", data[20 + size : 28 + size])
        assert (rest, kind) == (len(data) - 28 - size, b"BIN\0")
        self._data = data[28 + size :]
        self.faces, self.lines = np.empty((0, 3), np.int64), np.empty((0, 2), np.int64)
        for primitive in self.document["meshes"][0]["primitives"]:
            indices = self._numbers(primitive["indices"]).astype(np.int64)
            if primitive["mode"] == 4:
                self.faces = indices.reshape(-1, 3)
            else:
                assert primitive["mode"] == 1
                self.lines = indices.reshape(-1, 2)
        attributes = primitive["attributes"]
        self.vertices: Array = self._numbers(attributes["POSITION"]).astype(np.float64)
        """(V, 3)."""
        self.colours: Array = self._numbers(attributes["COLOR_0"])[:, :3] / 65535.0
        """(V, 3) linear, from 0 to 1."""

    def _numbers(self, accessor: int) -> NDArray[Any]:
        held = self.document["accessors"][accessor]
        view = self.document["bufferViews"][held["bufferView"]]
        part = self._data[view["byteOffset"] :][: view["byteLength"]]
        numbers = np.frombuffer(part, TYPES[held["componentType"]])
        assert len(numbers) == held["count"] * COLUMNS[held["type"]]
        return numbers.reshape(-1, COLUMNS[held["type"]])
