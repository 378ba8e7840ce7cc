"""Conversion of states and commands to messages and back, compiled for all layouts and robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..compiled.kernels import kernel, subroutine
from ..samples import Command, RobotNames, RobotState, State, Timebase
from ..topics import Topic
from .messages import MessageDescription, Numbers, Offsets, describe

Array = NDArray[np.float64]
Bytes = NDArray[np.uint8]

FOREIGN = -1 << 62
"""Returned instead of a stamp if the message has another layout."""
_BILLION = 1_000_000_000


@subroutine
def little_endian(data: Any, at: Any, size: int) -> int:
    """Return an unsigned little-endian integer of ``size`` bytes."""
    value: Any = np.uint64(0)
    for i in range(size):
        value |= np.uint64(data[at + np.uint64(i)]) << np.uint64(8 * i)
    return value  # type: ignore[no-any-return]


@subroutine
def is_laid_out(data: Any, pattern: Bytes) -> bool:
    """Return True if a message, which must be long enough, has a layout's constant bytes."""
    differing = np.uint8(0)
    for i in range(pattern.shape[1]):
        differing |= (data[i] ^ pattern[0, i]) & pattern[1, i]
    return differing == 0  # type: ignore[no-any-return]


@subroutine
def stamp_of(data: Any) -> int:
    """Return the time at the start of a message, ns."""
    seconds: Any = np.int64(np.int32(little_endian(data, np.uint64(4), 4)))
    nanoseconds: Any = np.int64(little_endian(data, np.uint64(8), 4))
    return seconds * _BILLION + nanoseconds  # type: ignore[no-any-return]


@subroutine
def _store(data: Bytes, at: Any, value: Any, size: int) -> None:
    for i in range(size):
        data[at + np.uint64(i)] = np.uint8(value >> np.uint64(8 * i) & np.uint64(0xFF))


@kernel
def write(wire: Bytes, places: Offsets, values: Array, stamp_ns: int) -> None:
    """Write a stamp and numbers into a message.

    Args:
        wire: bytes of the message.
        places: (2, K) byte offset in the message, index into ``values``.
        values: numbers of a sample.
        stamp_ns: its stamp.
    """
    _store(wire, np.uint64(4), np.uint64(stamp_ns // _BILLION & 0xFFFFFFFF), 4)
    _store(wire, np.uint64(8), np.uint64(stamp_ns % _BILLION), 4)
    bits = values.view(np.uint64)
    for k in range(places.shape[1]):
        if places[1, k] >= np.uint64(len(bits)):
            raise IndexError("a sample with too few numbers")
        _store(wire, places[0, k], bits[places[1, k]], 8)


@kernel
def read(data: bytes, pattern: Bytes, places: Offsets, values: Array) -> int:
    """Read the numbers of a message; return its stamp, ns, or `FOREIGN` for another layout.

    Args:
        data: the message; bytes after the layout, from other writers, are ignored.
        pattern: `MessageLayout.pattern`.
        places: (2, K) byte offset in the message, index into ``values``.
        values: numbers of a sample.
    """
    if len(data) < pattern.shape[1] or not is_laid_out(data, pattern):
        return FOREIGN
    bits = values.view(np.uint64)
    for k in range(places.shape[1]):
        if places[1, k] >= np.uint64(len(bits)):
            raise IndexError("a sample with too few numbers")
        bits[places[1, k]] = little_endian(data, places[0, k], 8)
    return stamp_of(data)


class CompiledCodec:
    """Writes and reads the messages of a topic.

    A message with our layout, or that of the last one, is read by copying its numbers; a new layout
    is decoded in general form once.
    """

    def __init__(
        self, description: MessageDescription, record: np.dtype[Any] | None = None
    ) -> None:
        """Create the codec.

        Args:
            description: of the messages.
            record: dtype of the sample, with the columns as fields (None: only the columns).
        """
        self._description = description
        own = description.own()
        self._into = _indices(description, record)
        self._wire: Bytes = own.layout.pattern[0].copy()
        self._own = self._places(own)
        self._read_like(own)

    def _places(self, numbers: Numbers) -> Offsets:
        return np.stack((numbers.offsets, self._into))

    def _read_like(self, known: Numbers) -> None:
        self._pattern, self._known = known.layout.pattern, self._places(known)

    def encode(self, stamp_ns: int, values: Array) -> bytes:
        """Return the serialized message of a sample."""
        write(self._wire, self._own, values, stamp_ns)
        return self._wire.tobytes()

    def decode(self, data: bytes, values: Array) -> int:
        """Read a message into a sample's numbers; return its stamp, ns."""
        stamp_ns = self.read(data, values)
        if stamp_ns == FOREIGN:
            layout = self._description.learn(data)
            self._read_like(layout)
            return self.read(layout.layout.data, values)
        return stamp_ns

    def read(self, data: bytes, values: Array) -> int:
        """Decode a message with the layout of the last one; return `FOREIGN` for another layout."""
        return read(data, self._pattern, self._known, values)


def _indices(description: MessageDescription, record: np.dtype[Any] | None) -> Offsets:
    if record is None or record.fields is None:
        return np.arange(description.width, dtype=np.uint64)
    starts = [record.fields[name][1] // 8 + first for name, first, _ in description.columns]
    lengths = [column.length for column in description.columns]
    return np.concatenate(
        [np.arange(a, a + k, dtype=np.uint64) for a, k in zip(starts, lengths, strict=True)]
    )


class StateCodec:
    """Converts `RobotState` to the messages of its parts and back."""

    def __init__(self, names: RobotNames, timebase: Timebase) -> None:
        """Create the codecs; of parts that not every robot has only if ``names`` has any."""
        self._timebase, record = timebase, State.dtype(len(names.joints))
        self.parts = {
            topic: CompiledCodec(describe(topic, names, timebase), record)
            for topic in topics.STATES
            if not topic.is_optional or getattr(names, topic.of)
        }
        self.topics = tuple(self.parts)
        """Topics of all messages, in the order of sending."""
        self.control_topics = tuple(t for t in self.topics if t.is_controlling)
        """Topics of the messages that a controller needs."""

    def encode(self, state: RobotState) -> tuple[bytes, ...]:
        """Return the bytes of all messages."""
        stamp_ns, numbers = self._timebase.stamp_ns(state.tick), state.numbers
        return tuple([codec.encode(stamp_ns, numbers) for codec in self.parts.values()])

    def decode(self, topic: Topic, data: bytes, state: RobotState) -> int:
        """Write one message into ``state``; return its tick."""
        return self._timebase.tick(self.parts[topic].decode(data, state.numbers))


class CommandCodec:
    """Converts `Command` to /command and back."""

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """Create the codec; ``names`` are those of `RobotNames.commanded`."""
        self._timebase = timebase
        self._codec = CompiledCodec(describe(topics.COMMAND, names, timebase))

    def encode(self, command: Command) -> bytes:
        """Return the bytes of /command, with the stamp of the state that it answers."""
        return self._codec.encode(self._timebase.stamp_ns(command.tick), command.torque)

    def decode(self, data: bytes, command: Command) -> None:
        """Write a message into ``command``."""
        command.tick = self._timebase.tick(self._codec.decode(data, command.torque))
