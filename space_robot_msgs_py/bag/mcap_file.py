"""One MCAP file of a bag, with records in the same order as rosbag2 writes."""

from __future__ import annotations

import errno
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, Literal, NamedTuple, cast

from mcap.data_stream import RecordBuilder
from mcap.records import DataEnd, Footer
from mcap.writer import MCAP0_MAGIC, CompressionType, IndexType, Writer

Compression = Literal["none", "lz4", "zstd"]
_COMPRESSIONS: dict[Compression, CompressionType] = {
    "none": CompressionType.NONE,
    "lz4": CompressionType.LZ4,
    "zstd": CompressionType.ZSTD,
}
_INDEXES = IndexType.CHUNK | IndexType.MESSAGE | IndexType.METADATA
_NEVER_FULL = 1 << 62
"""Size of a chunk: only `McapFile.flush` ends one."""
_MESSAGE_BYTES = 31
"""Length of a message's record without its data."""


class Channel(NamedTuple):
    """A topic in the file."""

    topic: str
    type: str
    definition: bytes
    metadata: dict[str, str]


class McapFile:
    """An `mcap.Writer` whose chunks end on request, each passed to the kernel at once."""

    def __init__(self, path: Path, channels: Sequence[Channel], compression: Compression) -> None:
        """Create the file. The numbers of the channels begin at 1.

        Raises:
            OSError: that failed; no file is left.
        """
        self.path = path
        self.size = 0
        """Bytes written."""
        self.open_bytes = 0
        """Bytes of the messages in the open chunk."""
        self.counts: Counter[int] = Counter()
        """Number of messages by channel."""
        self.span_ns: tuple[int, int] | None = None
        """First and last log time (None: no message)."""
        self._file = path.open("xb", buffering=0)
        self._writer = Writer(
            cast(IO[Any], self),
            chunk_size=_NEVER_FULL,
            compression=_COMPRESSIONS[compression],
            index_types=_INDEXES,
        )
        try:
            self._writer.start("ros2", "space_robot")
        except OSError:
            self.remove()
            raise
        schemas: dict[str, int] = {}
        for channel in channels:
            if channel.type not in schemas:
                schemas[channel.type] = self._writer.register_schema(
                    channel.type, "ros2msg", channel.definition
                )
        for channel in channels:
            schema = schemas[channel.type]
            self._writer.register_channel(channel.topic, "cdr", schema, channel.metadata)

    def add(self, channel: int, log_ns: int, publish_ns: int, sequence: int, data: bytes) -> None:
        """Add a message to the open chunk."""
        self._writer.add_message(channel, log_ns, data, publish_ns, sequence)
        self.counts[channel] += 1
        self.open_bytes += _MESSAGE_BYTES + len(data)
        first, last = self.span_ns or (log_ns, log_ns)
        self.span_ns = min(first, log_ns), max(last, log_ns)

    def add_metadata(self, name: str, data: Mapping[str, str]) -> None:
        """Write a metadata record, before the open chunk.

        Raises:
            OSError: that failed.
        """
        self._writer.add_metadata(name, dict(data))

    def end_chunk(self) -> None:
        """Write the open chunk with its message indexes.

        Raises:
            OSError: that failed; `abandon` leaves the chunks of before.
        """
        self._writer.flush()
        self.open_bytes = 0

    def finish(self) -> None:
        """Write indexes and statistics, and close the file.

        Raises:
            OSError: that failed.
        """
        self._writer.finish()
        self._file.close()

    def abandon(self, size: int) -> None:
        """After a failure: keep the first ``size`` bytes and, if there is room, end the file."""
        if self._file.closed:
            return
        end = RecordBuilder()
        DataEnd(0).write(end)
        Footer(0, 0, 0).write(end)
        with suppress(OSError):
            self._file.truncate(size)
            os.pwrite(self._file.fileno(), end.end() + MCAP0_MAGIC, size)
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

    def write(self, data: bytes) -> None:
        """Write all bytes, or raise an error; called by `mcap.Writer`, as `tell` and `flush`."""
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]
        self.size += len(data)

    def tell(self) -> int:
        """Return the number of bytes written."""
        return self.size

    def flush(self) -> None:
        """Do nothing: the kernel has all bytes."""
