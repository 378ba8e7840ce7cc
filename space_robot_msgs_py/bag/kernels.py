"""Compiled loops over the messages of a bag: positions and numbers of many at once.

Flat arrays in and out, so that each is compiled once for every robot and every layout.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled.kernels import kernel, subroutine
from ..wire.codecs import FOREIGN, is_laid_out, little_endian, stamp_of
from ..wire.messages import Offsets

Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]

CHANNEL, START, LENGTH, LOG_NS, PUBLISH_NS = range(5)
"""Rows of the result of `walk_messages`."""
NO_STAMP = FOREIGN
"""Stamp of a message that is too short to have one."""
_HEAD = 9
_FIELDS = 22
_MESSAGE = 5
_ENCAPSULATION = 4


@subroutine
def _integer(data: Bytes, at: int, size: int) -> int:
    return np.int64(little_endian(data, np.uint64(at), size))  # type: ignore[return-value]


@kernel
def walk_messages(data: Bytes, start: int, messages: Integers, before: int) -> tuple[int, int]:
    """Locate consecutive MCAP Message records from ``start`` on.

    Returns:
        How many there are in ``messages``, a column each behind the ``before`` first, and where
        they end: at a record of another kind, one that is not whole, or the end of the data.
    """
    at, count = start, before
    while count < messages.shape[1] and len(data) - at >= _HEAD + _FIELDS and data[at] == _MESSAGE:
        length = _integer(data, at + 1, 8)
        if length < _FIELDS or length > len(data) - at - _HEAD:
            break
        messages[CHANNEL, count] = _integer(data, at + 9, 2)
        messages[START, count] = at + _HEAD + _FIELDS
        messages[LENGTH, count] = length - _FIELDS
        messages[LOG_NS, count] = _integer(data, at + 15, 8)
        messages[PUBLISH_NS, count] = _integer(data, at + 23, 8)
        at += _HEAD + length
        count += 1
    return count, at


@kernel
def read_stamps(data: Bytes, starts: Integers, lengths: Integers, stamps: Integers) -> None:
    """Read the time, ns, at the begin of each message, or `NO_STAMP`."""
    for i in range(len(starts)):
        stamps[i] = NO_STAMP
        if lengths[i] >= _ENCAPSULATION + 8:
            head = data[starts[i] : starts[i] + _ENCAPSULATION + 8]
            if head[0] == 0 and head[1] == 0:  # written by a big-endian machine
                stamps[i] = stamp_of(np.concatenate((head[:4], head[7:3:-1], head[:7:-1])))
            else:
                stamps[i] = stamp_of(head)


@kernel
def gather(
    data: Bytes,
    starts: Integers,
    lengths: Integers,
    pattern: Bytes,
    offsets: Offsets,
    numbers: NDArray[np.float64],
    fits: NDArray[np.bool_],
) -> None:
    """Copy the numbers of all messages with the same layout.

    Args:
        data: what the messages lie in, at ``starts`` with ``lengths``.
        starts: first byte of each.
        lengths: bytes of each; what lies behind the layout is ignored.
        pattern: `MessageLayout.pattern`.
        offsets: (K,) bytes from a message's beginning to each number.
        numbers: (messages, K) numbers of each.
        fits: whether a message is laid out so; of others nothing is copied.
    """
    size = pattern.shape[1]
    bits = numbers.view(np.uint64)
    for i in range(len(starts)):
        fits[i] = lengths[i] >= size
        if not fits[i]:
            continue
        message = data[starts[i] : starts[i] + size]
        fits[i] = is_laid_out(message, pattern)
        if fits[i]:
            for k in range(len(offsets)):
                bits[i, k] = little_endian(message, offsets[k], 8)
