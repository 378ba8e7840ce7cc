"""Waiting for messages of subscriptions without executor."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence

from rclpy.node import Node

from .endpoints import RawSubscription
from .rclpy_internals import SubscriptionWaitSet

SPIN_S = 300e-6
"""Time of polling and yielding before sleeping in the wait set. Not under SCHED_FIFO, where
yielding has no effect and sleeping threads wake without delay."""


class Waiter:
    """Waits until one of some subscriptions has a message."""

    def __init__(self, node: Node) -> None:
        """Create the waiter; ``node`` is any node of the process."""
        self._context = node.context
        self._sets: dict[int, SubscriptionWaitSet] = {}

    def wait(self, inputs: Sequence[RawSubscription], timeout_s: float) -> None:
        """Sleep until there is a message, or until the timeout."""
        size = len(inputs)
        if size not in self._sets:
            self._sets[size] = SubscriptionWaitSet(self._context, size)
        self._sets[size].wait([entry.handle for entry in inputs], timeout_s)


def take_or_wait(entry: RawSubscription, waiter: Waiter, timeout_s: float) -> bytes | None:
    """Return the next message of ``entry``: poll and yield for a moment, then sleep, poll again."""
    data = entry.take()
    if data is not None:
        return data
    until = time.perf_counter() + SPIN_S
    while time.perf_counter() < until:
        os.sched_yield()
        data = entry.take()
        if data is not None:
            return data
    waiter.wait((entry,), timeout_s)
    return entry.take()
