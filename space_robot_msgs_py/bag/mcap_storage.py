"""Reader of an MCAP file, chunk by chunk, up to its end or its first damage.

The mcap library parses records, and decompresses and checks chunks. Only the messages, of
which there are millions, are located in compiled code.
"""

from __future__ import annotations

import zlib
from collections import Counter
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Footer, Metadata, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from .batch import Batch
from .kernels import CHANNEL, LENGTH, LOG_NS, PUBLISH_NS, START, Bytes, Integers, walk_messages
from .mcap_records import (
    BROKEN,
    DESCRIPTIONS,
    HEAD,
    INDEX_HEAD,
    LEAST_MESSAGE,
    PASSED,
    PIECE,
    cause,
    check_index,
    decompressed,
    parse,
    whole_messages,
)

_FOOTER_BYTES = 29
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
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._index_fault = ""
        self._fault = ""
        self._is_broken = False
        self._of_no_topic = 0
        with path.open("rb") as file:
            self.is_mcap = file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC
            file.seek(max(0, self.size - len(MCAP0_MAGIC)))
            self.has_end = self.size > len(MCAP0_MAGIC) and file.read() == MCAP0_MAGIC
            for record in self._records(file, before_messages=True):
                self._note(record)
            if self.has_end:
                self._read_summary(file)

    def batches(self) -> Iterator[Batch]:
        """Yield all messages in the order in which they were written.

        Raises:
            OSError: the file can no longer be read.
        """
        self._fault, self._of_no_topic, self._is_broken = "", 0, False
        pieces: list[bytes] = []
        with self.path.open("rb") as file:
            for record in self._records(file):
                if isinstance(record, bytes):
                    pieces.append(record)
                else:
                    self._note(record)
                if sum(map(len, pieces)) >= _BATCH_BYTES:
                    yield from self._walk(pieces)
                    pieces = []
                if self._is_broken:
                    return
            yield from self._walk(pieces)

    def topics(self) -> dict[str, str]:
        """Type by topic (empty: not known), of all channels met so far."""
        return {channel.topic: self._type(channel) for channel in self._channels.values()}

    @property
    def incomplete(self) -> bool:
        """True if something could not be read."""
        return bool(self._fault or self._of_no_topic)

    @property
    def damage(self) -> list[str]:
        """Damage of the file; complete after `batches`."""
        texts = [self._index_fault] if self._index_fault else []
        if self._fault:
            texts.append(self._fault)
        if self._of_no_topic:
            texts.append(f"{self._of_no_topic} messages of an unknown topic")
        return [f"{self.path.name}: {text}" for text in texts]

    def _read_summary(self, file: BinaryIO) -> None:
        """Read channels and counts from the end of the file."""
        try:
            at = self.size - len(MCAP0_MAGIC) - _FOOTER_BYTES
            file.seek(at)
            end = file.read(_FOOTER_BYTES)
            opcode, length = HEAD.unpack_from(end)
            if opcode != Opcode.FOOTER or length != _FOOTER_BYTES - HEAD.size:
                raise ValueError("no footer")
            footer = Footer.read(ReadDataStream(BytesIO(end[HEAD.size :])))
            if not footer.summary_start:
                return
            if not 0 < footer.summary_start < at:
                raise ValueError("its place is outside the file")
            file.seek(footer.summary_start)
            summary = file.read(at - footer.summary_start)
            if footer.summary_crc not in (0, zlib.crc32(summary + end[:-4])):
                raise ValueError("CRC")
            self._note_summary(summary)
        except BROKEN as error:
            self._index_fault = f"its index cannot be read ({cause(error)})"

    def _note_summary(self, summary: bytes) -> None:
        at = 0
        while at < len(summary):
            opcode, length = HEAD.unpack_from(summary, at)
            at += HEAD.size
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.STATISTICS):
                self._note(parse(opcode, summary[at : at + length]))
            at += length

    def _note(self, record: Any) -> None:
        if isinstance(record, Schema):
            self._schemas[record.id] = record
        elif isinstance(record, Channel):
            self._channels[record.id] = record
        elif isinstance(record, Metadata):
            self.metadata[record.name] = record.metadata
        elif isinstance(record, Statistics):
            self.counts = Counter()
            for number, count in record.channel_message_counts.items():
                if number in self._channels:
                    self.counts[self._channels[number].topic] += count

    def _records(self, file: BinaryIO, before_messages: bool = False) -> Iterator[Any]:
        """The data section's records; messages as the bytes of many records.

        They end before a record that cannot be read.
        """
        at = len(MCAP0_MAGIC) if self.is_mcap else 0
        while at < self.size:
            file.seek(at)
            try:
                opcode, length = HEAD.unpack(file.read(HEAD.size))
                if length > self.size - at - HEAD.size:
                    raise ValueError("a record that ends behind the file")
                if opcode == Opcode.DATA_END and length == 4:
                    return
                if before_messages and opcode in (Opcode.MESSAGE, Opcode.CHUNK):
                    return
                if opcode == Opcode.MESSAGE:
                    file.seek(at)
                    piece = file.read(max(PIECE, HEAD.size + length))
                    whole = whole_messages(piece)
                    yield piece[:whole]
                    at += whole
                    continue
                if opcode == Opcode.CHUNK:
                    yield decompressed(parse(opcode, file.read(length)))
                elif opcode in DESCRIPTIONS:
                    yield parse(opcode, file.read(length))
                elif opcode == Opcode.MESSAGE_INDEX:
                    check_index(file.read(INDEX_HEAD.size), length)
                elif opcode not in PASSED:
                    raise ValueError("no record of MCAP")
                at += HEAD.size + length
            except BROKEN as error:
                if before_messages:
                    return
                if self.has_end:  # else it is where writing ended
                    self._fault = f"unreadable from byte {at} on ({cause(error)})"
                return

    def _walk(self, pieces: list[bytes]) -> Iterator[Batch]:
        """The messages of several chunks: fewer batches, less to do for each."""
        data = np.frombuffer(b"".join(pieces), np.uint8)
        messages = np.empty((5, len(data) // LEAST_MESSAGE + 1), np.int64)
        count, stop = 0, 0
        for piece in pieces:
            start, stop = stop, stop + len(piece)
            count = self._walk_chunk(data[:stop], start, messages, count)
            if self._is_broken:
                break
        if count:
            yield from self._by_topic(data, messages[:, :count])

    def _walk_chunk(self, data: Bytes, at: int, messages: Integers, count: int) -> int:
        """Locate messages and channels from ``at`` on; return the number of messages."""
        start = at
        while at < len(data):
            count, at = walk_messages(data, at, messages, count)
            if at == len(data):
                break
            try:
                opcode, length = HEAD.unpack(data[at : at + HEAD.size].tobytes())
                if opcode == Opcode.MESSAGE or length > len(data) - at - HEAD.size:
                    raise ValueError("a message that is not whole in a chunk")
                if opcode in DESCRIPTIONS:
                    body = at + HEAD.size
                    self._note(parse(opcode, data[body : body + length].tobytes()))
                at += HEAD.size + length
            except BROKEN as error:
                # Damage that stopped `_records` lies behind this chunk.
                place = f"from its byte {at - start} on"
                self._fault = f"a chunk is unreadable {place} ({cause(error)})"
                self._is_broken = True
                break
        return count

    def _by_topic(self, data: Bytes, messages: Integers) -> Iterator[Batch]:
        for number in np.flatnonzero(np.bincount(messages[CHANNEL])).tolist():
            own = messages[:, messages[CHANNEL] == number]
            channel = self._channels.get(number)
            if channel is None:
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
