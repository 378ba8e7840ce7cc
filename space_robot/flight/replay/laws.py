"""Recorded laws and gains, put in force again at their ticks."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable

from space_robot_msgs_py.samples import LawInForce


class RecordedLaws:
    """Sets, before each state, the law and gains that the live controller had in flight.

    In flight they changed between two states, too, so the replayed controller takes over, and
    remembers, as the flown one did. Independent of ROS.
    """

    def __init__(
        self,
        laws: Iterable[LawInForce],
        put: Callable[[LawInForce], None],
        start_again: Callable[[], None],
    ) -> None:
        """Begin before the first state.

        Args:
            laws: by rising tick.
            put: puts a law in force; returns when that has been done.
            start_again: gives the controller a fresh memory, as a restart did in flight.
        """
        self._coming = deque(laws)
        self._put, self._start_again = put, start_again
        self._has_begun = False

    def before(self, tick: int) -> None:
        """Put in force the law of ``tick`` before its state is sent; call it for each tick."""
        if not self._coming or self._coming[0].tick > tick:
            self._has_begun = True
            return
        due = [self._coming.popleft()]
        while self._coming and self._coming[0].tick <= tick:
            due.append(self._coming.popleft())
        if self._has_begun and any(law.is_first for law in due):
            self._start_again()
        self._put(due[-1])
        self._has_begun = True
