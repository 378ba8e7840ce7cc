"""Records of an MCAP file, parsed and decompressed by the mcap library.

Lengths are checked first, since wrong ones in a damaged file would exhaust the memory.
"""

from __future__ import annotations

import struct
from io import BytesIO
from typing import Any

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Metadata, Schema, Statistics
from mcap.stream_reader import get_chunk_data_stream

from .kernels import walk_messages

BROKEN = (
    McapError,
    zstandard.ZstdError,
    struct.error,
    ValueError,
    RuntimeError,
    OverflowError,
    MemoryError,
)
"""The errors of mcap, lz4 and zstd on bytes that end early or make no sense."""
HEAD = struct.Struct("<BQ")
INDEX_HEAD = struct.Struct("<HI")
_PARSED: dict[int, Any] = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.METADATA: Metadata,
    Opcode.CHUNK: Chunk,
    Opcode.STATISTICS: Statistics,
}
DESCRIPTIONS = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.METADATA)
PASSED = (Opcode.HEADER, Opcode.ATTACHMENT)
PIECE = 1 << 20
LEAST_MESSAGE = 31
_MOST_EXPANDED = 1000
"""A chunk that claims to be larger, compared with its compressed bytes, is broken."""


def parse(opcode: int, body: bytes) -> Any:
    """Parse a record from its content.

    Raises:
        ValueError: or another of `BROKEN`: the record is invalid.
    """
    stream = ReadDataStream(BytesIO(body))
    record = _PARSED[opcode].read(stream)
    if stream.count != len(body):
        raise ValueError("a record of another length than it says")
    return record


def decompressed(chunk: Chunk) -> bytes:
    """Return the records of a chunk, decompressed and checked.

    Raises:
        ValueError: or another of `BROKEN`: they cannot be read.
    """
    size = chunk.uncompressed_size
    if size > _MOST_EXPANDED * len(chunk.data) + PIECE:
        raise ValueError(f"{len(chunk.data)} bytes that claim to be {size}")
    stream, length = get_chunk_data_stream(chunk, validate_crc=True)
    if length != size:
        raise ValueError(f"{length} bytes instead of {size}")
    data: bytes = stream.read(length)
    return data


def whole_messages(piece: bytes) -> int:
    """Return the length in bytes of the whole messages at the beginning of ``piece``."""
    messages = np.empty((5, len(piece) // LEAST_MESSAGE + 1), np.int64)
    _, end = walk_messages(np.frombuffer(piece, np.uint8), 0, messages, 0)
    if not end:
        raise ValueError("a message that is not whole")
    return int(end)


def check_index(head: bytes, length: int) -> None:
    """Check that a record of this length may be a message index.

    Raises:
        ValueError: it is not.
    """
    if INDEX_HEAD.unpack(head)[1] != length - INDEX_HEAD.size:
        raise ValueError("no message index")


def cause(error: BaseException) -> str:
    """Return the cause of an error in one short line."""
    text = " ".join(str(error).split()) or type(error).__name__
    if "crc" in text.lower():
        return "CRC"
    return text if len(text) <= 60 else text[:57] + "..."
