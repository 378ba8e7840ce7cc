"""Messages to flat numbers and back in compiled code, the same for every layout and robot."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..compiled.kernels import kernel, subroutine
from .message import MessageDescription, Numbers, Offsets

Array = NDArray[np.float64]
Bytes = NDArray[np.uint8]

FOREIGN = -1 << 62
"""In place of a stamp: the message is laid out otherwise."""
_BILLION = 1_000_000_000


@subroutine
def little_endian(data: Any, at: Any, size: int) -> int:
    """An unsigned integer of ``size`` bytes."""
    value: Any = np.uint64(0)
    for i in range(size):
        value |= np.uint64(data[at + np.uint64(i)]) << np.uint64(8 * i)
    return value  # type: ignore[no-any-return]


@subroutine
def is_laid_out(data: Any, pattern: Bytes) -> bool:
    """Whether a message has the bytes that are the same in all of a layout; it is long enough."""
    differing = np.uint8(0)
    for i in range(pattern.shape[1]):
        differing |= (data[i] ^ pattern[0, i]) & pattern[1, i]
    return differing == 0  # type: ignore[no-any-return]


@subroutine
def stamp_of(data: Any) -> int:
    """The time a message begins with, ns."""
    seconds: Any = np.int64(np.int32(little_endian(data, np.uint64(4), 4)))
    nanoseconds: Any = np.int64(little_endian(data, np.uint64(8), 4))
    return seconds * _BILLION + nanoseconds  # type: ignore[no-any-return]


@subroutine
def _store(data: Bytes, at: Any, value: Any, size: int) -> None:
    """An integer of ``size`` bytes, little endian."""
    for i in range(size):
        data[at + np.uint64(i)] = np.uint8(value >> np.uint64(8 * i) & np.uint64(0xFF))


@kernel
def write(wire: Bytes, places: Offsets, values: Array, stamp_ns: int) -> None:
    """Put a stamp and numbers into a message.

    Args:
        wire: its bytes.
        places: (2, K) byte of the message, index into ``values``.
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
    """Take the numbers of a message; its stamp, ns, or `FOREIGN` if it is laid out otherwise.

    Args:
        data: the message; what lies behind the layout is ignored: foreign writers leave some there.
        pattern: `MessageLayout.pattern`.
        places: (2, K) byte of the message, index into ``values``.
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
    """Writes our own messages of a topic, and reads all that say what ours say.

    A message laid out as ours, or as the one read last, is read by copying its numbers; any other
    is decoded the general way once.
    """

    def __init__(
        self, description: MessageDescription, record: np.dtype[Any] | None = None
    ) -> None:
        """``record``: of the sample, whose fields the columns name (None: they are all of it)."""
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
        """Our own message with the numbers of a sample."""
        write(self._wire, self._own, values, stamp_ns)
        return self._wire.tobytes()

    def decode(self, data: bytes, values: Array) -> int:
        """Fill a sample's numbers; the stamp, ns.

        Raises:
            MessageError: the message does not fit, or is none.
        """
        stamp_ns = self.read(data, values)
        if stamp_ns == FOREIGN:
            layout = self._description.learn(data)
            self._read_like(layout)
            return self.read(layout.layout.data, values)
        return stamp_ns

    def read(self, data: bytes, values: Array) -> int:
        """`decode`, but only of what is laid out as the message before; else `FOREIGN`."""
        return read(data, self._pattern, self._known, values)


def _indices(description: MessageDescription, record: np.dtype[Any] | None) -> Offsets:
    """Places of the columns' numbers among all of a sample."""
    fields = record.fields if record is not None else None
    if fields is None:
        return np.arange(sum(column.length for column in description.columns), dtype=np.uint64)
    firsts = [fields[name][1] // 8 + first for name, first, _ in description.columns]
    runs = [
        np.arange(first, first + column.length)
        for first, column in zip(firsts, description.columns, strict=True)
    ]
    indices: Offsets = np.concatenate(runs).astype(np.uint64)
    return indices
