"""Plausibility check of the stamps of states."""

from __future__ import annotations

from typing import Any

AGREEING = 5
"""Number of consecutive consistent stamps after which a new time is accepted."""


class StampGuard:
    """Accepts stamps that increase by at most a limit; independent of ROS.

    A single stamp that goes back or jumps is rejected. Several consistent ones mean a new time: the
    plant was restarted, or this node was suspended.
    """

    def __init__(self, longest_jump: int) -> None:
        """Create the guard; ``longest_jump`` is the largest accepted step in ticks."""
        self.longest_jump = longest_jump
        self.last = -1
        """Last accepted tick; -1 before the first."""
        self.is_new_time = False
        """True if the last accepted tick started a new time."""
        self.other = -1
        """Last rejected tick."""
        self.agreeing = 0
        """Number of consistent ticks that were rejected one after the other."""

    def passes(self, tick: int) -> bool:
        """Return True if ``tick`` is accepted; it is then the last one."""
        return accept(self, tick)


def describe_new_time(tick: int, last: int, is_resumed: bool) -> str:
    """Return the log text for the first tick of a new time, or of a node that was inactive before.

    Args:
        tick: the accepted tick.
        last: the one accepted before.
        is_resumed: whether the node has been activated since.
    """
    what = "active again" if is_resumed and tick > last else "a new time begins"
    return f"{what} at tick {tick}, after {last}"


def accept(guard: Any, tick: int) -> bool:
    """Return whether ``tick`` is accepted by a `StampGuard`, or by a record of its attributes.

    Plain Python; the controller compiles it as a ``@kernel``.
    """
    step = tick - guard.last
    follows = step > 0 and step <= guard.longest_jump
    if not follows and guard.last >= 0:
        since = tick - guard.other
        agrees = guard.agreeing > 0 and since >= 0 and since <= guard.longest_jump
        guard.agreeing = guard.agreeing + 1 if agrees else 1
        guard.other = tick
        if guard.agreeing < AGREEING:
            return False
    guard.last = tick
    guard.agreeing = 0
    guard.is_new_time = not follows
    return True
