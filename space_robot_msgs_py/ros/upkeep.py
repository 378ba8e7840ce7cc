"""A node's work between the steps of its loop: service calls, and reports of its health."""

from __future__ import annotations

import time
from typing import Protocol

from .service_calls import ServiceCalls

PERIOD_S = 0.1
"""A look for service calls takes time that a loop needs: not too often."""
SERVICE_SHARE = 0.1
"""Service calls that wait one behind another take no more than this share of a loop's time."""
LONGEST_PAUSE_S = 1.0


class Served(Protocol):
    """The part of a node that `Upkeep` needs."""

    calls: ServiceCalls

    def report(self) -> None:
        """Report the health if it is time again."""


class Upkeep:
    """Runs a node's service calls and reports its health, each when it is due.

    In flight one of the two at a time: both take longer than a tick leaves free.
    """

    def __init__(self, node: Served) -> None:
        self.node = node
        self._next_call = self._next_report = 0.0

    def run(self, timeout_s: float = 0.0) -> float:
        """Run a service call that waits or report the health, if it is time.

        Args:
            timeout_s: how long a call is waited for, where there is no flight that waits for this.

        Returns:
            When to be called again, by the monotonic clock.
        """
        now = time.monotonic()
        looks = timeout_s > 0.0 or self._next_call <= min(now, self._next_report)
        if looks:
            has_run = self.node.calls.run_one(timeout_s)
            begin, now = now, time.monotonic()
            # after one call look for another soon, but let them take no more than their share;
            # the answer to a client that has gone takes the middleware 0.1 s
            pause = min((now - begin) / SERVICE_SHARE, LONGEST_PAUSE_S)
            self._next_call = now + (pause if has_run else PERIOD_S)
        if now >= self._next_report and (timeout_s or not looks):
            self._next_report = now + PERIOD_S
            self.node.report()
        return min(self._next_call, self._next_report)
