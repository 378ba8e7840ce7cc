"""One MCAP file of a bag, with records in the same order as rosbag2 writes."""

from __future__ import annotations

import errno
import os
import zlib
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any, Literal

import lz4.frame
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

from .chunk import OpenChunk

Compression = Literal["none", "lz4", "zstd"]
_COMPRESS: dict[Compression, tuple[str, Callable[[bytes], bytes]]] = {
    "none": ("", bytes),
    "lz4": ("lz4", lz4.frame.compress),
    "zstd": ("zstd", zstandard.compress),
}
"""Name in the file, and function."""


def record_bytes(*records: Any) -> bytes:
    """MCAP records as they stand in a file."""
    builder = RecordBuilder()
    for record in records:
        record.write(builder)
    return bytes(builder.end())


class McapFile:
    """Writer of whole chunks, each passed to the kernel at once."""

    def __init__(
        self, path: Path, definitions: Sequence[Schema | Channel], compression: Compression
    ) -> None:
        """Create the file. ``definitions`` are in its first chunk already; repeated at its end.

        Raises:
            OSError: that failed; no file is left.
        """
        self.path = path
        self.size = 0
        """Bytes written."""
        self.counts: Counter[int] = Counter()
        """Number of messages by channel."""
        self.span_ns: tuple[int, int] | None = None
        """First and last log time (None: no message)."""
        self._definitions = definitions
        self._compression, self._compress = _COMPRESS[compression]
        self._chunks: list[ChunkIndex] = []
        self._metadata: list[MetadataIndex] = []
        self._file = path.open("xb", buffering=0)
        try:
            header = Header(profile="ros2", library="space_robot")
            self._put(MCAP0_MAGIC + record_bytes(header))
        except OSError:
            self.remove()
            raise

    def add_chunk(self, chunk: OpenChunk) -> None:
        """Write a chunk with its message indexes.

        Raises:
            OSError: that failed; `abandon` leaves the chunks of before.
        """
        content, (first, last) = bytes(chunk.content), chunk.span_ns
        data = self._compress(content)
        head = Chunk(
            compression=self._compression,
            data=data,
            message_start_time=first,
            message_end_time=last,
            uncompressed_crc=zlib.crc32(content),
            uncompressed_size=len(content),
        )
        record, start = record_bytes(head), self.size
        indexes = chunk.message_indexes()
        offsets, end = {}, start + len(record)
        for channel, index in indexes.items():
            offsets[channel] = end
            end += len(index)
        self._put(b"".join((record, *indexes.values())))
        self._chunks.append(
            ChunkIndex(
                message_start_time=first,
                message_end_time=last,
                chunk_start_offset=start,
                chunk_length=len(record),
                message_index_offsets=offsets,
                message_index_length=end - start - len(record),
                compression=self._compression,
                compressed_size=len(data),
                uncompressed_size=len(content),
            )
        )
        self.counts.update(chunk.counts)
        old = self.span_ns or (first, last)
        self.span_ns = min(first, old[0]), max(last, old[1])

    def add_metadata(self, name: str, data: Mapping[str, str]) -> None:
        """Write a metadata record.

        Raises:
            OSError: that failed.
        """
        record, start = record_bytes(Metadata(name=name, metadata=dict(data))), self.size
        self._put(record)
        self._metadata.append(MetadataIndex(offset=start, length=len(record), name=name))

    def finish(self) -> None:
        """Write indexes and statistics, and close the file.

        Raises:
            OSError: that failed.
        """
        summary = bytearray()
        start = self.size + len(record_bytes(DataEnd(0)))
        offsets = []
        schemas = [record for record in self._definitions if isinstance(record, Schema)]
        channels = [record for record in self._definitions if isinstance(record, Channel)]
        for opcode, group in (
            (Opcode.SCHEMA, schemas),
            (Opcode.CHANNEL, channels),
            (Opcode.STATISTICS, [self._statistics(len(schemas), len(channels))]),
            (Opcode.CHUNK_INDEX, self._chunks),
            (Opcode.METADATA_INDEX, self._metadata),
        ):
            if group:
                data = record_bytes(*group)
                offsets.append(SummaryOffset(opcode, start + len(summary), len(data)))
                summary += data
        offset_start = start + len(summary)
        summary += record_bytes(*offsets)
        # the CRC is of everything up to itself, the footer's own fields too
        footer = record_bytes(Footer(start, offset_start, summary_crc=0))
        crc = zlib.crc32(summary + footer[:-4])
        footer = record_bytes(Footer(start, offset_start, crc))
        self._put(record_bytes(DataEnd(0)) + summary + footer + MCAP0_MAGIC)
        self._file.close()

    def abandon(self, size: int) -> None:
        """After a failure: keep the first ``size`` bytes and, if there is room, end the file."""
        if self._file.closed:
            return
        end = record_bytes(DataEnd(0), Footer(0, 0, 0)) + MCAP0_MAGIC
        with suppress(OSError):
            self._file.truncate(size)
            os.pwrite(self._file.fileno(), end, size)
        self._file.close()

    def remove(self) -> None:
        """Close and delete the file."""
        self._file.close()
        self.path.unlink(missing_ok=True)

    def check_in_place(self) -> None:
        """Check that the file is still at its path.

        Raises:
            FileNotFoundError: it was removed or moved away.
        """
        with suppress(FileNotFoundError, NotADirectoryError):
            if os.path.samestat(self.path.stat(), os.fstat(self._file.fileno())):
                return
        raise FileNotFoundError(errno.ENOENT, "its file was removed or moved away")

    def _put(self, data: bytes) -> None:
        """Write all bytes, or raise an error."""
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]
        self.size += len(data)

    def _statistics(self, schemas: int, channels: int) -> Statistics:
        first, last = self.span_ns or (0, 0)
        return Statistics(
            attachment_count=0,
            channel_count=channels,
            channel_message_counts=dict(self.counts),
            chunk_count=len(self._chunks),
            message_count=self.counts.total(),
            message_start_time=first,
            message_end_time=last,
            metadata_count=len(self._metadata),
            schema_count=schemas,
        )
