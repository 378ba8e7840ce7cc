"""Batches of messages, in which a bag is read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from .kernels import Bytes, Integers


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

    def __len__(self) -> int:
        return len(self.starts)

    def message(self, index: int) -> bytes:
        """Return the bytes of one message."""
        start = int(self.starts[index])
        return self.data[start : start + int(self.lengths[index])].tobytes()

    def select(self, which: NDArray[np.bool_] | NDArray[np.intp]) -> Batch:
        """Select some of the messages."""
        return Batch(
            self.topic,
            self.type,
            self.encoding,
            self.data,
            self.starts[which],
            self.lengths[which],
            self.log_ns[which],
            self.publish_ns[which],
        )
