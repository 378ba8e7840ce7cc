"""Pixels as PNG (ISO/IEC 15948), three times as fast as Pillow and no larger.

Pillow tries five filters on every row. On line drawings none of them does any good.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np
from numpy.typing import NDArray

LEVEL = 4
"""Of zlib: higher ones take much longer and save little."""


def encode_png(pixels: NDArray[np.uint8], dots_per_inch: int) -> bytes:
    """The file of ``pixels`` (height, width, 3) in RGB, equal ones always as the same bytes."""
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), np.uint8)  # the first byte of a row: no filter
    rows[:, 1:] = pixels.reshape(height, 3 * width)
    per_metre = round(dots_per_inch / 0.0254)
    return b"".join(
        (
            b"\x89PNG\r\n\x1a\n",
            _chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
            _chunk(b"pHYs", struct.pack(">IIB", per_metre, per_metre, 1)),
            _chunk(b"IDAT", zlib.compress(rows.tobytes(), LEVEL)),
            _chunk(b"IEND", b""),
        )
    )


def _chunk(kind: bytes, content: bytes) -> bytes:
    check = zlib.crc32(content, zlib.crc32(kind))
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", check)
