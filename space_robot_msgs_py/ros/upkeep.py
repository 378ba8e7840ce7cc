"""Upkeep of a node between the steps of its loop: service calls and health reports."""

from __future__ import annotations

import time
from typing import Protocol

from .service_calls import ServiceCalls

PERIOD_S = 0.1
"""Period of checks for service calls, which take time of the loop."""
SERVICE_SHARE = 0.1
"""Maximum share of a loop's time for queued service calls."""
LONGEST_PAUSE_S = 1.0


class Served(Protocol):
    """Interface of a node for `Upkeep`."""

    calls: ServiceCalls

    def report(self) -> None:
        """Report the health if it is due."""


class Upkeep:
    """Executes a node's service calls and reports its health, each when due.

    In flight only one of the two at a time, since both together take longer than a tick allows.
    """

    def __init__(self, node: Served) -> None:
        self.node = node
        self._next_call = self._next_report = 0.0

    def run(self, timeout_s: float = 0.0) -> float:
        """Execute a waiting service call or report the health, if due.

        Args:
            timeout_s: time to wait for a call; only without flight.

        Returns:
            Time of the next call of this method, monotonic clock.
        """
        now = time.monotonic()
        looks = timeout_s > 0.0 or self._next_call <= min(now, self._next_report)
        if looks:
            has_run = self.node.calls.run_one(timeout_s)
            begin, now = now, time.monotonic()
            # after a call check again soon, within the allowed share of time; the answer to a
            # client that has ended takes the middleware 0.1 s
            pause = min((now - begin) / SERVICE_SHARE, LONGEST_PAUSE_S)
            self._next_call = now + (pause if has_run else PERIOD_S)
        if now >= self._next_report and (timeout_s or not looks):
            self._next_report = now + PERIOD_S
            self.node.report()
        return min(self._next_call, self._next_report)
