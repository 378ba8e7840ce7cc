"""Deadlines of a flight's ticks by the wall clock."""

from __future__ import annotations

import math
import time

SPIN_BEFORE_DEADLINE_S = 100e-6
"""The last part of the wait for a deadline, in which the plant polls and does not sleep, s."""
SLIP_S = 0.25
"""A flight further behind the wall clock does not catch up."""
REMARK_S = 5.0
"""Least time between two remarks on lost time, s."""


class WallClock:
    """Deadlines at a fixed period, never drifting; they slip as a whole when hopelessly missed."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._begin = 0.0
        self.lost_time_s = 0.0
        """Time by which the wall clock has run ahead for good."""
        self._remarked_s, self._remarked_at = 0.0, -math.inf

    def start(self, tick: int) -> None:
        """Begin ``tick`` now."""
        self._begin = time.monotonic() - tick * self._period

    def left(self, tick: int) -> float:
        """Return the time until ``tick`` is over, s; negative if it is."""
        return self._begin + (tick + 1) * self._period - time.monotonic()

    def slip(self, tick: int) -> float:
        """Set the deadlines back if ``tick`` was over long ago; returns by how much, s."""
        behind = -self.left(tick)
        if behind < SLIP_S:
            return 0.0
        self._begin += behind
        self.lost_time_s += behind
        return behind

    def remark(self) -> str:
        """Return a remark on the time lost since the last one; empty if that was just now."""
        now = time.monotonic()
        lost, since = self.lost_time_s - self._remarked_s, now - self._remarked_at
        if since < REMARK_S or not lost:
            return ""
        within = f" in {since:.1f} s, {self.lost_time_s:.3f} s in all" if self._remarked_s else ""
        self._remarked_s, self._remarked_at = self.lost_time_s, now
        return f"{lost:.3f} s behind the wall clock{within}: time goes on from here"
