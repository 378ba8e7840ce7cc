"""The law in force: the one chosen last, by hand or by a swap that is due."""

from __future__ import annotations

from collections.abc import Iterable

from space_robot_msgs_py.bag.law_history import LawChange

from ..laws import ControlLaw
from .law_changes import LawChanges


class LawChoice:
    """Keeps the law to be flown from tick to tick. Knows no ROS."""

    def __init__(self, chosen: ControlLaw, swaps: Iterable[tuple[int, ControlLaw]] = ()) -> None:
        """Begin with a law; ``swaps`` are ticks, rising, and the laws from there on."""
        self._chosen = chosen
        self._swaps = list(swaps)
        self._changes = LawChanges()
        self._may_differ = True
        """True if law or gains may be others than at the last tick answered."""
        self.was_swapped = False
        """True once a swap was due; whoever has told it may take that back."""

    @property
    def chosen(self) -> ControlLaw:
        """The law that answers next."""
        return self._chosen

    def choose(self, law: ControlLaw) -> None:
        """Answer with ``law`` from now on, whose gains may have been changed."""
        self._chosen, self._may_differ = law, True

    def change_at(self, tick: int) -> LawChange | None:
        """Choose the law of the swaps that are due; what is in force, if not as before.

        Called once for each tick that is answered.
        """
        while self._swaps and self._swaps[0][0] <= tick:
            self.choose(self._swaps.pop(0)[1])
            self.was_swapped = True
        if not self._may_differ:
            return None
        self._may_differ = False
        return self._changes.at(tick, self._chosen)
