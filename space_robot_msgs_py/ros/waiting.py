"""Waiting for messages of subscriptions that no executor knows."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence

from rclpy.node import Node

from .endpoints import RawSubscription
from .rclpy_internals import SubscriptionWaitSet

SPIN_S = 300e-6
"""How long a wait takes and yields before it sleeps in the wait set. Not under SCHED_FIFO, where
yielding gives way to nobody and sleeping threads wake at once."""


class Waiter:
    """Waits until one of some subscriptions has something to take."""

    def __init__(self, node: Node) -> None:
        """``node``: any of the process' nodes."""
        self._context = node.context
        self._sets: dict[int, SubscriptionWaitSet] = {}

    def wait(self, inputs: Sequence[RawSubscription], timeout_s: float) -> None:
        """Sleep until a message is there or the time is over."""
        size = len(inputs)
        if size not in self._sets:
            self._sets[size] = SubscriptionWaitSet(self._context, size)
        self._sets[size].wait([entry.handle for entry in inputs], timeout_s)


def take_or_wait(entry: RawSubscription, waiter: Waiter, timeout_s: float) -> bytes | None:
    """The next message of ``entry``: look and yield for a moment, then sleep, then look again."""
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
