"""The law in force from tick to tick, as it goes on record."""

from __future__ import annotations

from space_robot_msgs_py.bag.law_history import LawChange, same
from space_robot_msgs_py.samples import LawInForce

from ..laws import ControlLaw


class LawChanges:
    """Tells when a controller is given another law, or its law other gains."""

    def __init__(self) -> None:
        self._last: LawInForce | None = None

    def at(self, tick: int, law: ControlLaw) -> LawChange | None:
        """The change if ``tick``, the next to be answered, is answered otherwise than the last."""
        before, now = self._last, law.in_force(tick, is_first=self._last is None)
        if before and same(before, now):
            return None
        self._last = now
        return LawChange(before, now)
