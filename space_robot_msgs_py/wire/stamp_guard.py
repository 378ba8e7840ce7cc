"""Plausibility check of the stamps of states."""

from __future__ import annotations

AGREEING = 5
"""Number of consecutive consistent stamps after which a new time is accepted."""


class StampGuard:
    """Accepts stamps that increase by at most a limit; independent of ROS.

    A single stamp that goes back or jumps is rejected. Several consistent ones mean a new time: the
    plant was restarted, or this node was suspended.
    """

    def __init__(self, longest_jump: int) -> None:
        """Create the guard; ``longest_jump`` is the largest accepted step in ticks."""
        self._longest_jump = longest_jump
        self.last = -1
        """Last accepted tick; -1 before the first."""
        self.is_new_time = False
        """True if the last accepted tick started a new time."""
        self._other = -1
        self._agreeing = 0

    def passes(self, tick: int) -> bool:
        """Return True if ``tick`` is accepted; it is then the last one."""
        follows = 0 < tick - self.last <= self._longest_jump
        if not follows and self.last >= 0:
            agrees = self._agreeing and 0 <= tick - self._other <= self._longest_jump
            self._agreeing = self._agreeing + 1 if agrees else 1
            self._other = tick
            if self._agreeing < AGREEING:
                return False
        self.last, self._agreeing, self.is_new_time = tick, 0, not follows
        return True
