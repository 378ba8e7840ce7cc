"""Stamps of states, believed or not."""

from __future__ import annotations

AGREEING = 5
"""So many other stamps in a row that fit one another are a new time, not a fault."""


class StampGuard:
    """Lets stamps pass that rise by no more than a jump. Independent of ROS.

    A single stamp that goes back or jumps is wrong. Several that agree mean a new time: the plant
    has started anew, or this node has slept.
    """

    def __init__(self, longest_jump: int) -> None:
        """``longest_jump``: ticks from one state to the next that are still believed."""
        self._longest_jump = longest_jump
        self.last = -1
        """The last tick believed; -1 before the first."""
        self.is_new_time = False
        """True if the last tick believed did not follow the one before."""
        self._other = -1
        self._agreeing = 0

    def passes(self, tick: int) -> bool:
        """Return True if a state of ``tick`` is to be believed, which is then the last one."""
        follows = 0 < tick - self.last <= self._longest_jump
        if not follows and self.last >= 0:
            agrees = self._agreeing and 0 <= tick - self._other <= self._longest_jump
            self._agreeing = self._agreeing + 1 if agrees else 1
            self._other = tick
            if self._agreeing < AGREEING:
                return False
        self.last, self._agreeing, self.is_new_time = tick, 0, not follows
        return True
