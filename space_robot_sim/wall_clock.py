"""When the ticks of a flight are over by the wall clock."""

from __future__ import annotations

import time

SLIP_S = 0.25
"""Further behind the wall clock than this, nobody catches up."""


class WallClock:
    """Deadlines at a fixed period, never drifting; they slip as a whole when hopelessly missed."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._begin = 0.0
        self.slipped_s = 0.0
        """How far the wall clock has run ahead for good."""

    def start(self, tick: int) -> None:
        """``tick`` begins now."""
        self._begin = time.monotonic() - tick * self._period

    def left(self, tick: int) -> float:
        """Time until ``tick`` is over, s; negative if it is."""
        return self._begin + (tick + 1) * self._period - time.monotonic()

    def slip(self, tick: int) -> float:
        """Set the deadlines back if ``tick`` was over long ago; returns by how much, s."""
        behind = -self.left(tick)
        if behind < SLIP_S:
            return 0.0
        self._begin += behind
        self.slipped_s += behind
        return behind
