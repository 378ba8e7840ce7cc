"""Compiled loops over the messages of a bag: where they lie, and numbers out of many at once.

Flat arrays in and out, so that each is compiled once for every robot and every layout.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..compiled.kernels import kernel, subroutine

Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]

CHANNEL, START, LENGTH, LOG_NS, PUBLISH_NS = range(5)
"""Rows of what `walk_messages` finds."""
NO_STAMP = -(1 << 62)
"""In place of the stamp of a message that is too short for one."""
_HEAD = 9
_FIELDS = 22
_MESSAGE = 5
_ENCAPSULATION = 4


@subroutine
def _little_endian(data: Bytes, at: int, size: int) -> int:
    value: Any = np.uint64(0)
    for i in range(size):
        value |= np.uint64(data[at + i]) << np.uint64(8 * i)
    return np.int64(value)  # type: ignore[return-value]


@kernel
def walk_messages(data: Bytes, start: int, found: Integers, before: int) -> tuple[int, int]:
    """MCAP's Message records that stand one behind the other from ``start`` on.

    Returns:
        How many there are in ``found``, a column each behind the ``before`` first, and where they
        end: at a record of another kind, one that is not whole, or the end of the data.
    """
    at, count = start, before
    while count < found.shape[1] and len(data) - at >= _HEAD + _FIELDS and data[at] == _MESSAGE:
        length = _little_endian(data, at + 1, 8)
        if length < _FIELDS or length > len(data) - at - _HEAD:
            break
        found[CHANNEL, count] = _little_endian(data, at + 9, 2)
        found[START, count] = at + _HEAD + _FIELDS
        found[LENGTH, count] = length - _FIELDS
        found[LOG_NS, count] = _little_endian(data, at + 15, 8)
        found[PUBLISH_NS, count] = _little_endian(data, at + 23, 8)
        at += _HEAD + length
        count += 1
    return count, at


@kernel
def read_stamps(data: Bytes, starts: Integers, lengths: Integers, stamps: Integers) -> None:
    """The time, ns, each message begins with, or `NO_STAMP`."""
    for i in range(len(starts)):
        stamps[i] = NO_STAMP
        if lengths[i] >= _ENCAPSULATION + 8:
            at = starts[i] + _ENCAPSULATION
            seconds = np.int64(np.int32(_little_endian(data, at, 4)))
            stamps[i] = seconds * 1_000_000_000 + _little_endian(data, at + 4, 4)


@kernel
def gather(
    data: Bytes, starts: Integers, lengths: Integers, layout: Bytes, constant: Bytes,
    runs: Integers, numbers: Bytes, fits: NDArray[np.bool_],
) -> None:  # fmt: skip
    """Copy the numbers of all messages that are laid out alike.

    Args:
        data: what the messages lie in, at ``starts`` with ``lengths``.
        starts: first byte of each.
        lengths: bytes of each; what lies behind the layout is ignored.
        layout: the bytes of one message.
        constant: which bits of it are the same in all.
        runs: offset and length of each run of numbers, in bytes.
        numbers: (messages, bytes) the runs of each, one behind the other.
        fits: whether a message is laid out so; of others nothing is copied.
    """
    for i in range(len(starts)):
        fits[i] = lengths[i] >= len(layout)
        if not fits[i]:
            continue
        message = data[starts[i] : starts[i] + len(layout)]
        differing = np.uint8(0)
        for k in range(len(layout)):
            differing |= (message[k] ^ layout[k]) & constant[k]
        fits[i] = differing == 0
        if not fits[i]:
            continue
        to = 0
        for r in range(len(runs)):
            source = message[runs[r, 0] : runs[r, 0] + runs[r, 1]]
            target = numbers[i, to : to + runs[r, 1]]
            for k in range(len(source)):
                target[k] = source[k]
            to += runs[r, 1]
