"""Batches of messages, and the numbers of many messages at once, in compiled loops.

The first message of a layout is decoded the general way; it tells where the numbers stand in all
that are laid out alike. Flat arrays in and out, so that each loop is compiled once for every robot
and every layout.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..compiled.kernels import kernel, subroutine
from ..errors import MessageError
from ..wire.codecs import FOREIGN, is_laid_out, little_endian, stamp_of
from ..wire.messages import MessageDescription, Numbers, Offsets

Array = NDArray[np.float64]
Bytes = NDArray[np.uint8]
Integers = NDArray[np.int64]
Places = NDArray[np.intp]

CHANNEL, START, LENGTH, LOG_NS, PUBLISH_NS = range(5)
"""Rows of the result of `walk_messages`."""
NO_STAMP = FOREIGN
"""Stamp of a message that is too short to have one."""
_HEAD = 9
_FIELDS = 22
LEAST_MESSAGE = _HEAD + _FIELDS
"""Bytes of an MCAP Message record without its data."""
_MESSAGE = 5
_ENCAPSULATION = 4


@dataclass(frozen=True, slots=True)
class Batch:
    """Messages of one topic that lie in one piece of memory, in the order they were written."""

    topic: str
    type: str
    """As in ``sensor_msgs/msg/JointState``; empty if the bag does not say."""
    encoding: str
    """``cdr``, if it is ROS 2's."""
    data: Bytes
    starts: Integers
    lengths: Integers
    log_ns: Integers
    publish_ns: Integers

    @classmethod
    def of(cls, topic: str, kind: str, messages: Sequence[tuple[int, bytes]]) -> Batch:
        """Return a batch of messages with their log times, ns."""
        data = np.frombuffer(b"".join(message for _, message in messages), np.uint8)
        lengths = np.array([len(message) for _, message in messages], np.int64)
        log_ns = np.array([stamp % 2**63 for stamp, _ in messages], np.int64)
        return cls(topic, kind, "cdr", data, np.cumsum(lengths) - lengths, lengths, log_ns, log_ns)

    def __len__(self) -> int:
        return len(self.starts)

    def message(self, index: int) -> bytes:
        """Return the bytes of one message."""
        start = int(self.starts[index])
        return self.data[start : start + int(self.lengths[index])].tobytes()

    def select(self, which: NDArray[np.bool_] | Places) -> Batch:
        """Select some of the messages."""
        return replace(
            self,
            starts=self.starts[which],
            lengths=self.lengths[which],
            log_ns=self.log_ns[which],
            publish_ns=self.publish_ns[which],
        )

    @property
    def stamps(self) -> Integers:
        """(M,) stamps, ns; `NO_STAMP` of messages without."""
        stamps = np.empty(len(self), np.int64)
        read_stamps(self.data, self.starts, self.lengths, stamps)
        return stamps


class FieldReader:
    """Reader of the numbers in the messages of a topic."""

    def __init__(self, description: MessageDescription) -> None:
        self.description = description
        self._known: Numbers | None = None
        self.misfits = 0
        """Number of messages that could not be read."""
        self.fault = ""
        """Reason why the first of these could not be read."""

    def read(self, batch: Batch) -> Iterator[tuple[Places, Array]]:
        """Yield, for each layout, places of messages in the batch and their (M, width) numbers."""
        left: Places = np.arange(len(batch))
        while len(left):
            if self._known:
                fits, values = _take(self._known, batch, left)
                if fits.any():
                    yield (left, values) if fits.all() else (left[fits], values[fits])
                    left = left[~fits]
                    continue
            try:
                self._known = self.description.learn(batch.message(left[0]))
                yield left[:1], self._known.values[None]
            except MessageError as error:
                self.misfits += 1
                self.fault = self.fault or str(error)
            left = left[1:]


def _take(numbers: Numbers, batch: Batch, left: Places) -> tuple[NDArray[np.bool_], Array]:
    values, fits = np.empty((len(left), len(numbers.offsets))), np.empty(len(left), np.bool_)
    starts, lengths = batch.starts[left], batch.lengths[left]
    gather(batch.data, starts, lengths, numbers.layout.pattern, numbers.offsets, values, fits)
    return fits, values


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
    """Read the time, ns, at the beginning of each message, or `NO_STAMP`."""
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
    numbers: Array,
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
