"""Choice of the law in force, by the user or by planned swaps."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from space_robot_msgs_py.bag.law_history import LawChange

from ..laws import ControlLaw
from .law_changes import LawChanges
from .supervision import swaps_due


class LawChoice:
    """The law in force from tick to tick. Independent of ROS."""

    def __init__(self, chosen: ControlLaw, swaps: Iterable[tuple[int, ControlLaw]] = ()) -> None:
        """Begin with a law; ``swaps`` are increasing ticks with the laws in force from each."""
        self._chosen = chosen
        planned = list(swaps)
        self._ticks = np.array([tick for tick, _ in planned], dtype=np.float64)
        self._laws = [law for _, law in planned]
        self._made = 0
        self._changes = LawChanges()
        self._may_differ = True
        """True if law or gains may differ from the last tick answered."""
        self.was_swapped = False
        """True after a swap; to be cleared by the caller that reports it."""

    @property
    def chosen(self) -> ControlLaw:
        """The law that answers next."""
        return self._chosen

    def choose(self, law: ControlLaw) -> None:
        """Choose ``law`` from now on; its gains may have changed."""
        self._chosen, self._may_differ = law, True

    def change_at(self, tick: int) -> LawChange | None:
        """Apply the swaps that are due; return the law in force if it changed.

        Called once for each tick that is answered.
        """
        due = swaps_due(self._ticks, self._made, tick) if self._made < len(self._laws) else 0
        if due > self._made:
            self._made = due
            self.choose(self._laws[due - 1])
            self.was_swapped = True
        if not self._may_differ:
            return None
        self._may_differ = False
        return self._changes.at(tick, self._chosen)
