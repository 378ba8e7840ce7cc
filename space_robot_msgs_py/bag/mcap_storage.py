"""Messages and metadata of an MCAP file, chunk by chunk, up to its end or its first damage.

The mcap library parses records, and decompresses and checks chunks. Only the messages in them, of
which there are millions, are located in compiled code.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import BinaryIO

import numpy as np
import zstandard
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import Channel, Chunk, DataEnd, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

from .batch import (
    CHANNEL,
    LEAST_MESSAGE,
    LENGTH,
    LOG_NS,
    PUBLISH_NS,
    START,
    Batch,
    Bytes,
    walk_messages,
)

BROKEN = (
    *(McapError, zstandard.ZstdError, struct.error),
    *(ValueError, RuntimeError, OverflowError, MemoryError),
)
"""The errors of mcap, lz4 and zstd on bytes that end early or make no sense."""
_HEAD = struct.Struct("<BQ")
"""Opcode and length of a record."""
_MESSAGE = struct.Struct("<BQHIQQ")
"""The same with channel, sequence, log and publish time of a message."""
_BATCH_BYTES = 4 << 20


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
        self.damage: list[str] = []
        """Damage of the file, one sentence each; complete after `batches`."""
        self.incomplete = False
        """True if something could not be read; known after `batches`."""
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        with path.open("rb") as file:
            file.seek(max(0, self.size - len(MCAP0_MAGIC)))
            self.has_end = self.size > len(MCAP0_MAGIC) and file.read() == MCAP0_MAGIC
            """True if its writer closed it."""
            next(self._pieces(file), None)  # what is noted before the first message
            self.damage = []
            if self.has_end:
                self._read_summary(file)
        self._index_damage = self.damage

    def topics(self) -> dict[str, str]:
        """Return the type (empty: not known) by topic, of all channels met so far."""
        return {channel.topic: self._type(channel) for channel in self._channels.values()}

    def batches(self) -> Iterator[Batch]:
        """Yield all messages in the order in which they were written.

        Raises:
            OSError: the file can no longer be read.
        """
        self.damage, self.incomplete = [*self._index_damage], False
        pieces: list[bytes] = []
        length = 0
        with self.path.open("rb") as file:
            for piece in self._pieces(file):
                pieces.append(piece)
                length += len(piece)
                if length >= _BATCH_BYTES:  # there is less to do for few large batches
                    yield from self._batches_in(pieces)
                    pieces, length = [], 0
                    if self.incomplete:  # nothing is read behind damage
                        return
            yield from self._batches_in(pieces)

    def _pieces(self, file: BinaryIO) -> Iterator[bytes]:
        """Yield the records of chunks, and messages outside of chunks, up to the first damage."""
        file.seek(0)
        at = 0
        # a wrong length in a damaged file would exhaust the memory
        reader = _RecordReader(file, emit_chunks=True, record_size_limit=self.size)
        try:
            for record in reader.records:
                if isinstance(record, DataEnd):
                    return
                if isinstance(record, Chunk):
                    yield _decompressed(record)
                elif isinstance(record, Message):
                    yield _serialized(record)
                else:
                    self._note(record)
                at = file.tell()
        except BROKEN as error:
            if self.has_end:  # else it is where writing ended
                self._tell(f"unreadable from byte {at} on ({_cause(error)})")

    def _tell(self, damage: str) -> None:
        self.incomplete = True
        self.damage.append(f"{self.path.name}: {damage}")

    def _note(self, record: McapRecord) -> None:
        if isinstance(record, Schema):
            self._schemas[record.id] = record
        elif isinstance(record, Channel):
            self._channels[record.id] = record
        elif isinstance(record, Metadata):
            self.metadata[record.name] = record.metadata

    def _read_summary(self, file: BinaryIO) -> None:
        file.seek(0)
        try:
            summary = make_reader(file).get_summary()
        except (StopIteration, *BROKEN) as error:
            self._tell(f"its index cannot be read ({_cause(error)})")
            return
        if summary is None:
            return
        self._schemas |= summary.schemas
        self._channels |= summary.channels
        if summary.statistics:
            self.counts = Counter()
            for number, count in summary.statistics.channel_message_counts.items():
                if number in self._channels:
                    self.counts[self._channels[number].topic] += count

    def _batches_in(self, pieces: list[bytes]) -> Iterator[Batch]:
        data = np.frombuffer(b"".join(pieces), np.uint8)
        messages = np.empty((5, len(data) // LEAST_MESSAGE + 1), np.int64)
        count = at = 0
        try:
            while at < len(data):
                count, at = walk_messages(data, at, messages, count)
                if at < len(data):
                    at += self._note_first(data[at:])
        except BROKEN as error:
            self._tell(f"a chunk is unreadable ({_cause(error)})")
        located = messages[:, :count]
        for number in np.flatnonzero(np.bincount(located[CHANNEL])).tolist():
            own = located[:, located[CHANNEL] == number]
            if (channel := self._channels.get(number)) is None:
                self._tell(f"{own.shape[1]} messages of an unknown topic")
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

    def _note_first(self, data: Bytes) -> int:
        """Note the first record, a channel or schema among messages; return its length."""
        opcode, length = _HEAD.unpack(data[: _HEAD.size].tobytes())
        if opcode == Opcode.MESSAGE or length > len(data) - _HEAD.size:
            raise ValueError("a message that is not whole")
        end = _HEAD.size + int(length)
        self._note(next(StreamReader(BytesIO(data[:end].tobytes()), skip_magic=True).records))
        return end

    def _type(self, channel: Channel) -> str:
        schema = self._schemas.get(channel.schema_id)
        return schema.name if schema else ""


class _RecordReader(StreamReader):
    def _read_record(self, opcode: int, length: int) -> McapRecord | None:
        if opcode == Opcode.MESSAGE_INDEX:  # mcap parses it number by number, as long as all else
            self._stream.read(length)
            return None
        return super()._read_record(opcode, length)


def _decompressed(chunk: Chunk) -> bytes:
    stream, length = get_chunk_data_stream(chunk, validate_crc=True)
    if length != chunk.uncompressed_size:
        raise ValueError("a chunk that is not whole")
    data: bytes = stream.read(length)
    return data


def _serialized(m: Message) -> bytes:
    length = _MESSAGE.size - _HEAD.size + len(m.data)
    times = m.log_time, m.publish_time
    return _MESSAGE.pack(Opcode.MESSAGE, length, m.channel_id, m.sequence, *times) + m.data


def _cause(error: BaseException) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    if "crc" in text.lower():
        return "CRC"
    return text if len(text) <= 60 else text[:57] + "..."
