"""Messages collected for a chunk of an MCAP file.

Packed here and not by `mcap.Writer`, whose record objects cost the recorder 6 us a message.
"""

from __future__ import annotations

import struct
from itertools import chain

from mcap.opcode import Opcode

_MESSAGE = struct.Struct("<BQHIQQ")
_MESSAGE_FIELDS = 22
"""Bytes of a message record between its length and its data."""
_INDEX = struct.Struct("<BQHI")


class OpenChunk:
    """Records of a chunk that is still open, and the offset of each message."""

    def __init__(self, definitions: bytes = b"") -> None:
        """``definitions``: schema and channel records, in the first chunk of a file."""
        self.content = bytearray(definitions)
        self._starts: dict[int, list[int]] = {}  # by channel: log time, offset, log time, ...

    def add(self, channel: int, log_ns: int, publish_ns: int, sequence: int, data: bytes) -> None:
        """Append a message."""
        content = self.content
        self._starts.setdefault(channel, []).extend((log_ns, len(content)))
        content += _MESSAGE.pack(
            Opcode.MESSAGE, _MESSAGE_FIELDS + len(data), channel, sequence, log_ns, publish_ns
        )
        content += data

    def __bool__(self) -> bool:
        return bool(self._starts)

    @property
    def counts(self) -> dict[int, int]:
        """Number of messages by channel."""
        return {channel: len(starts) // 2 for channel, starts in self._starts.items()}

    @property
    def span_ns(self) -> tuple[int, int]:
        """First and last log time; there must be a message."""
        times = list(chain.from_iterable(starts[::2] for starts in self._starts.values()))
        return min(times), max(times)

    def message_indexes(self) -> dict[int, bytes]:
        """The message index records, by channel."""
        return {
            channel: _INDEX.pack(Opcode.MESSAGE_INDEX, 6 + 8 * len(s), channel, 8 * len(s))
            + struct.pack(f"<{len(s)}Q", *s)
            for channel, s in self._starts.items()
        }
