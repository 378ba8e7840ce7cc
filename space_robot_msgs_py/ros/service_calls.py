"""A node's service calls, run one by one between the ticks of its loop."""

from __future__ import annotations

import time
from typing import Any

from rclpy.executors import ShutdownException, SingleThreadedExecutor, TimeoutException
from rclpy.node import Node

from .rclpy_internals import ServiceWaitSet

OVERLOADED_S = 1.0
"""Calls that have been waiting without a break for this long are a storm."""
COUNTED_S = 0.1
"""Of the time from one call to the next: a few slow ones, as transitions, are no storm."""
FULL_LOOK_S = 5.0


class ServiceCalls(SingleThreadedExecutor):
    """Runs the callbacks of one node; counts them, and knows when they are too many."""

    def __init__(self, node: Node) -> None:
        super().__init__()
        self.add_node(node)
        self._requests = ServiceWaitSet(node)
        self._full_look_at = 0.0
        """When to look for what is no service call, too: the middleware's warnings."""
        self.count = 0
        """Calls run so far."""
        self.is_overloaded = False
        """True if calls come faster than they are run; beyond 1000 of a kind they are lost."""
        self._unfinished: list[Any] = []
        """Calls whose callback waits for something that the node's loop does."""
        self._began_at: float | None = None
        """When the last call began; None if none waited after it."""
        self._busy_s = 0.0
        """How long there has been no break."""

    def run_one(self, timeout_s: float = 0.0) -> bool:
        """Run a call that waits, or comes within ``timeout_s``; tell whether there was one."""
        if not timeout_s and not self._is_worth_a_look():
            return self._take_a_break()
        # the end of a call wakes the executor, whose next look then ends at once and finds nothing
        callback = self._next(timeout_s) or (self._next(0.0) if self._began_at else None)
        if callback is None:
            return self._take_a_break()
        if callback in self._unfinished:
            return self._go_on(callback)
        now = time.monotonic()
        self._busy_s += min(now - (self._began_at or now), COUNTED_S)
        self._began_at = now
        self.is_overloaded = self._busy_s > OVERLOADED_S
        callback()
        self.count += 1
        if not callback.done():
            self._unfinished.append(callback)
        elif error := callback.exception():
            raise error
        return True

    def _take_a_break(self) -> bool:
        """Note that no call waits: there is no storm."""
        self._began_at, self._busy_s, self.is_overloaded = None, 0.0, False
        return False

    def _go_on(self, callback: Any) -> bool:
        """Run a call again that waits for something; several looks for one call are no storm."""
        self._began_at, self._busy_s = None, 0.0
        callback()
        if callback.done():
            self._unfinished.remove(callback)
            if error := callback.exception():
                raise error
        return True

    def finish(self) -> None:
        """Run the callbacks that still wait, now that what they wait for has ended."""
        for callback in self._unfinished:
            callback()

    def _is_worth_a_look(self) -> bool:
        """Return whether a request waits, or whether it is time for a full look, which is slow."""
        if self._unfinished:
            return True
        if (now := time.monotonic()) < self._full_look_at:
            return self._requests.is_called()
        self._full_look_at = now + FULL_LOOK_S
        return True

    def _next(self, timeout_s: float) -> Any:
        try:
            return self.wait_for_ready_callbacks(timeout_sec=timeout_s)[0]
        except (TimeoutException, ShutdownException):
            return None
