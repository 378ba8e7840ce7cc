"""Messages and metadata of an MCAP file, chunk by chunk, up to its end or its first damage.

The mcap library parses records, and decompresses and checks chunks. Only the messages, of which
there are millions, are located in compiled code. Lengths are checked first, since wrong ones in a
damaged file would exhaust the memory.
"""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Metadata, Schema, Statistics
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

from .batch import CHANNEL, LEAST_MESSAGE, LENGTH, LOG_NS, PUBLISH_NS, START, Batch, walk_messages

BROKEN = (
    *(McapError, zstandard.ZstdError, struct.error),
    *(ValueError, RuntimeError, OverflowError, MemoryError),
)
"""The errors of mcap, lz4 and zstd on bytes that end early or make no sense."""
HEAD = struct.Struct("<BQ")
"""Opcode and length of a record."""
FOOTER = struct.Struct("<BQQQI")
"""The last record: opcode, length, start of the summary, start of its offsets, CRC."""
_PARSED: dict[int, Any] = {
    Opcode.SCHEMA: Schema,
    Opcode.CHANNEL: Channel,
    Opcode.METADATA: Metadata,
    Opcode.STATISTICS: Statistics,
}
_PIECE_BYTES = 1 << 20
_BATCH_BYTES = 4 << 20
_MOST_EXPANDED = 1000
"""A chunk that claims to be larger, compared with its compressed bytes, is broken."""


class McapStorage:
    """Messages and metadata of a file, as far as they can be read."""

    def __init__(self, path: Path) -> None:
        """Read the beginning and the end.

        Raises:
            OSError: the file cannot be read.
        """
        self.path = path
        self.size = path.stat().st_size
        self.metadata: dict[str, dict[str, str]] = {}
        """The metadata records, by name."""
        self.counts: Counter[str] | None = None
        """Number of messages per topic, from the file's statistics; None: no statistics."""
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._index_fault = self._fault = ""
        self._of_no_topic = 0
        with path.open("rb") as file:
            self._start = len(MCAP0_MAGIC) if file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC else 0
            file.seek(max(0, self.size - len(MCAP0_MAGIC)))
            self.has_end = self.size > len(MCAP0_MAGIC) and file.read() == MCAP0_MAGIC
            """True if its writer closed it."""
            next(self._pieces(file), None)  # what is noted before the first message
            if self.has_end:
                self._read_summary(file)

    def topics(self) -> dict[str, str]:
        """Return the type (empty: not known) by topic, of all channels met so far."""
        return {channel.topic: self._type(channel) for channel in self._channels.values()}

    @property
    def incomplete(self) -> bool:
        """True if something could not be read; known after `batches`."""
        return bool(self._fault or self._of_no_topic)

    @property
    def damage(self) -> list[str]:
        """Damage of the file, one sentence each; complete after `batches`."""
        texts = [text for text in (self._index_fault, self._fault) if text]
        if self._of_no_topic:
            texts.append(f"{self._of_no_topic} messages of an unknown topic")
        return [f"{self.path.name}: {text}" for text in texts]

    def batches(self) -> Iterator[Batch]:
        """Yield all messages in the order in which they were written.

        Raises:
            OSError: the file can no longer be read.
        """
        self._fault, self._of_no_topic = "", 0
        pieces: list[bytes] = []
        with self.path.open("rb") as file:
            for piece in self._pieces(file):
                pieces.append(piece)
                # Few large batches: there is less to do for each.
                if sum(map(len, pieces)) >= _BATCH_BYTES:
                    yield from self._walk(pieces)
                    pieces = []
                    if self._fault:  # nothing is read behind damage
                        return
            yield from self._walk(pieces)

    def _pieces(self, file: BinaryIO) -> Iterator[bytes]:
        """Yield the records of chunks, and messages outside of chunks, up to the first damage."""
        at = self._start
        while at < self.size:
            file.seek(at)
            try:
                opcode, length = HEAD.unpack(file.read(HEAD.size))
                if length > self.size - at - HEAD.size:
                    raise ValueError("a record that ends behind the file")
                if opcode == Opcode.DATA_END:
                    return
                if opcode == Opcode.CHUNK:
                    yield _decompressed(file.read(length))
                elif opcode == Opcode.MESSAGE:
                    file.seek(at)
                    piece = file.read(max(_PIECE_BYTES, HEAD.size + length))
                    length = _whole_messages(piece) - HEAD.size
                    yield piece[: HEAD.size + length]
                elif opcode in _PARSED:
                    self._note(opcode, file.read(length))
                elif opcode > Opcode.DATA_END or not opcode:
                    raise ValueError("no record of MCAP")
            except BROKEN as error:
                if self.has_end:  # else it is where writing ended
                    self._fault = self._fault or f"unreadable from byte {at} on ({_cause(error)})"
                return
            at += HEAD.size + length

    def _note(self, opcode: int, content: bytes) -> None:
        record = _PARSED[opcode].read(ReadDataStream(BytesIO(content)))
        if isinstance(record, Schema):
            self._schemas[record.id] = record
        elif isinstance(record, Channel):
            self._channels[record.id] = record
        elif isinstance(record, Metadata):
            self.metadata[record.name] = record.metadata
        else:
            self.counts = Counter()
            for number, count in record.channel_message_counts.items():
                if number in self._channels:
                    self.counts[self._channels[number].topic] += count

    def _read_summary(self, file: BinaryIO) -> None:
        """Note the channels and counts that are repeated at the end of the file."""
        try:
            at = self.size - len(MCAP0_MAGIC) - FOOTER.size
            file.seek(max(0, at))
            footer = file.read(FOOTER.size)
            opcode, _, start, _, crc = FOOTER.unpack(footer)
            if opcode != Opcode.FOOTER or start > at:
                raise ValueError("no footer")
            if not start:
                return
            file.seek(start)
            summary = file.read(at - start)
            if crc not in (0, zlib.crc32(summary + footer[:-4])):
                raise ValueError("CRC")
            place = 0
            while place < len(summary):
                opcode, length = HEAD.unpack_from(summary, place)
                place += HEAD.size + length
                if opcode in _PARSED:
                    self._note(opcode, summary[place - length : place])
        except BROKEN as error:
            self._index_fault = f"its index cannot be read ({_cause(error)})"

    def _walk(self, pieces: list[bytes]) -> Iterator[Batch]:
        """Yield the messages of several pieces, a batch a topic."""
        data = np.frombuffer(b"".join(pieces), np.uint8)
        messages = np.empty((5, len(data) // LEAST_MESSAGE + 1), np.int64)
        count, at = 0, 0
        while at < len(data):
            count, at = walk_messages(data, at, messages, count)
            if at == len(data):
                break
            try:
                opcode, length = HEAD.unpack(data[at : at + HEAD.size].tobytes())
                at += HEAD.size
                if opcode == Opcode.MESSAGE or length > len(data) - at:
                    raise ValueError("a message that is not whole")
                if opcode in _PARSED:
                    self._note(opcode, data[at : at + length].tobytes())
                at += length
            except BROKEN as error:
                self._fault = f"a chunk is unreadable ({_cause(error)})"
                break
        located = messages[:, :count]
        for number in np.flatnonzero(np.bincount(located[CHANNEL])).tolist():
            own = located[:, located[CHANNEL] == number]
            if (channel := self._channels.get(number)) is None:
                self._of_no_topic += own.shape[1]
                continue
            yield Batch(
                channel.topic,
                self._type(channel),
                channel.message_encoding,
                data,
                own[START],
                own[LENGTH],
                own[LOG_NS],
                own[PUBLISH_NS],
            )

    def _type(self, channel: Channel) -> str:
        schema = self._schemas.get(channel.schema_id)
        return schema.name if schema else ""


def _decompressed(content: bytes) -> bytes:
    chunk = Chunk.read(ReadDataStream(BytesIO(content)))
    if chunk.uncompressed_size > _MOST_EXPANDED * len(chunk.data) + _PIECE_BYTES:
        raise ValueError(f"{len(chunk.data)} bytes that claim to be {chunk.uncompressed_size}")
    stream, length = get_chunk_data_stream(chunk, validate_crc=True)
    data: bytes = stream.read(length)
    return data


def _whole_messages(piece: bytes) -> int:
    """Return the length in bytes of the whole messages at the beginning of ``piece``."""
    messages = np.empty((5, len(piece) // LEAST_MESSAGE + 1), np.int64)
    _, end = walk_messages(np.frombuffer(piece, np.uint8), 0, messages, 0)
    if not end:
        raise ValueError("a message that is not whole")
    return int(end)


def _cause(error: BaseException) -> str:
    """Return the cause of an error in one short line."""
    text = " ".join(str(error).split()) or type(error).__name__
    if "crc" in text.lower():
        return "CRC"
    return text if len(text) <= 60 else text[:57] + "..."
