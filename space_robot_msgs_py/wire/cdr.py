"""Fixed-layout CDR messages: written once, then only their numbers change.

The messages of a flight keep their names and lengths, so the bytes between the numbers never
change. `CdrBuilder` lays a message out field by field, in the order of its definition, and
remembers where the numbers stand; `FixedMessage` offers them as NumPy views.

Plain CDR, little endian: a primitive is aligned to its size counted from the end of the 4-byte
encapsulation header; a string is its length (with NUL), bytes, NUL; a sequence is its length,
then its elements.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import MessageError

Array = NDArray[np.float64]

_ENCAPSULATION = b"\x00\x01\x00\x00"
_BODY = len(_ENCAPSULATION)
_STAMP = struct.Struct("<iI")


@dataclass(frozen=True, slots=True)
class Slot:
    """Where a run of numbers stands: body offset and count of float64, or of int32 words."""

    offset: int
    count: int


class CdrBuilder:
    """Lays out one message; the ``*_slot`` methods leave room for numbers and say where."""

    def __init__(self) -> None:
        self._bytes = bytearray()
        self._numbers: list[tuple[int, int]] = []
        self._padding: list[tuple[int, int]] = []

    def uint8(self, value: int) -> None:
        """A constant uint8 (also a bool)."""
        self._bytes.append(value)

    def uint32(self, value: int) -> None:
        """A constant uint32 (also a sequence's length)."""
        self._align(4)
        self._bytes += struct.pack("<I", value)

    def string(self, value: str) -> None:
        """A constant string."""
        encoded = value.encode() + b"\0"
        self.uint32(len(encoded))
        self._bytes += encoded

    def strings(self, values: Sequence[str]) -> None:
        """A constant sequence of strings."""
        self.uint32(len(values))
        for value in values:
            self.string(value)

    def stamp_slot(self) -> Slot:
        """Room for a Time or a Duration: int32 seconds, uint32 nanoseconds."""
        return self._room(4, 2)

    def float64_slot(self, count: int) -> Slot:
        """Room for ``count`` float64, without a length."""
        return self._room(8, count)

    def float64_sequence_slot(self, count: int) -> Slot:
        """A length and room for ``count`` float64; an empty sequence has no padding after it."""
        self.uint32(count)
        return self._room(8, count) if count else Slot(len(self._bytes), 0)

    def header_slot(self, frame_id: str) -> Slot:
        """A std_msgs/Header with a constant frame: room for its stamp."""
        stamp = self.stamp_slot()
        self.string(frame_id)
        return stamp

    def build(self) -> FixedMessage:
        """The laid-out message."""
        return FixedMessage(bytes(self._bytes), self._numbers, self._padding)

    def _room(self, size: int, count: int) -> Slot:
        self._align(size)
        slot = Slot(len(self._bytes), count)
        self._bytes += bytes(size * count)
        self._numbers.append((slot.offset, slot.offset + size * count))
        return slot

    def _align(self, size: int) -> None:
        padding = -len(self._bytes) % size
        if padding:
            self._padding.append((len(self._bytes), len(self._bytes) + padding))
            self._bytes += bytes(padding)


class FixedMessage:
    """A message's bytes, with views on its numbers."""

    def __init__(
        self, body: bytes, numbers: list[tuple[int, int]], padding: list[tuple[int, int]]
    ) -> None:
        size = _BODY + len(body)
        room = np.zeros(3 * size + 16, dtype=np.uint8)
        start = -(room.ctypes.data + _BODY) % 8  # the float64 inside must be aligned in memory
        self._room = room[start : start + 3 * size]
        self._buffer = self._room[:size]
        self._buffer[:] = np.frombuffer(_ENCAPSULATION + body, dtype=np.uint8)
        self._memory = memoryview(self._buffer.data)
        self._size = size
        self._layout, self._constant = self._room[size : 2 * size], self._room[2 * size :]
        self._layout[:] = self._buffer
        self._constant[:] = 0xFF
        for start, stop in numbers + padding:  # a foreign writer pads with what it likes
            self._constant[_BODY + start : _BODY + stop] = 0

    def block(self, stamp: Slot, **slots: Slot) -> NDArray[Any]:
        """(1,) structured array on the numbers, for compiled code.

        Fields: ``sec`` and ``nanosec`` of the stamp, one of float64 for each of ``slots`` that is
        not empty, and what `compiled_cdr.receive` needs: ``wire``, ``layout``, ``constant``.
        """
        size = self._size
        fields = {
            "wire": (np.dtype((np.uint8, size)), 0),
            "layout": (np.dtype((np.uint8, size)), size),
            "constant": (np.dtype((np.uint8, size)), 2 * size),
            "sec": (np.dtype(np.int32), _BODY + stamp.offset),
            "nanosec": (np.dtype(np.uint32), _BODY + stamp.offset + 4),
        }
        for name, slot in slots.items():
            if slot.count:
                fields[name] = (np.dtype((np.float64, slot.count)), _BODY + slot.offset)
        layout = np.dtype(
            {
                "names": list(fields),
                "formats": [form for form, _ in fields.values()],
                "offsets": [offset for _, offset in fields.values()],
                "itemsize": 3 * size,
            }
        )
        return np.ndarray((1,), np.dtype((np.record, layout)), buffer=self._room.data)

    @property
    def pattern(self) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
        """The message's bytes, and which of their bits are the same in all messages."""
        return self._layout, self._constant

    @staticmethod
    def run(slot: Slot) -> tuple[int, int]:
        """Offset in the message and length of a slot of float64, in bytes."""
        return _BODY + slot.offset, 8 * slot.count

    def float64(self, slot: Slot) -> Array:
        """(count,) view."""
        start = _BODY + slot.offset
        return self._buffer[start : start + 8 * slot.count].view(np.float64)

    def float64_rows(self, slots: Sequence[Slot]) -> Array:
        """(rows, count) view on equally spaced slots, one a row."""
        return self._rows(slots, np.dtype(np.float64))

    def stamp_rows(self, slots: Sequence[Slot]) -> NDArray[np.int32]:
        """(rows, 2) view on equally spaced stamps: seconds, nanoseconds."""
        return self._rows(slots, np.dtype(np.int32))

    def _rows(self, slots: Sequence[Slot], dtype: np.dtype[Any]) -> NDArray[Any]:
        first, count = slots[0].offset, slots[0].count
        stride = slots[1].offset - first if len(slots) > 1 else dtype.itemsize * count
        if any(slot != Slot(first + i * stride, count) for i, slot in enumerate(slots)):
            raise ValueError("the slots are not equally spaced")
        start = _BODY + first
        stop = start + stride * (len(slots) - 1) + dtype.itemsize * count
        flat = self._buffer[start:stop]
        return np.ndarray(
            (len(slots), count), dtype, buffer=flat.data, strides=(stride, dtype.itemsize)
        )

    def set_stamp(self, slot: Slot, stamp_ns: int) -> None:
        """Write a Time or Duration."""
        _STAMP.pack_into(self._memory, _BODY + slot.offset, *divmod(stamp_ns, 1_000_000_000))

    def stamp_ns(self, slot: Slot) -> int:
        """Read a Time or Duration."""
        sec, nanosec = _STAMP.unpack_from(self._memory, _BODY + slot.offset)
        return int(sec * 1_000_000_000 + nanosec)

    def to_bytes(self) -> bytes:
        """The message as it goes on the wire."""
        return self._memory.tobytes()

    def load(self, data: bytes) -> bool:
        """Take the numbers out of ``data``; False, and nothing taken, if its layout differs."""
        if len(data) < self._size:  # foreign writers may leave bytes behind the message
            return False
        given = np.frombuffer(data, np.uint8, self._size)
        if np.any((given ^ self._layout) & self._constant):
            return False
        self._buffer[:] = given
        return True


def header_stamp_ns(data: bytes) -> int:
    """Stamp of a serialized message that starts with a Header or is a Time, ns.

    Raises:
        MessageError: the message ends before that.
    """
    try:
        sec, nanosec = _STAMP.unpack_from(data, _BODY)
    except struct.error:
        raise MessageError(f"a message of {len(data)} bytes has no stamp") from None
    return int(sec * 1_000_000_000 + nanosec)
