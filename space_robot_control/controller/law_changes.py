"""Changes of law and gains, for the record of a flight."""

from __future__ import annotations

from space_robot_msgs_py.bag.law_history import LawChange, same
from space_robot_msgs_py.samples import LawInForce

from ..laws import ControlLaw


class LawChanges:
    """Detector of changes of a controller's law or gains."""

    def __init__(self) -> None:
        self._last: LawInForce | None = None

    def at(self, tick: int, law: ControlLaw) -> LawChange | None:
        """Return the change at ``tick``, the next to be answered, if there is one."""
        before, now = self._last, law.in_force(tick, is_first=self._last is None)
        if before and same(before, now):
            return None
        self._last = now
        return LawChange(before, now)
