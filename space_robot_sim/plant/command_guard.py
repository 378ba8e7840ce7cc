"""Selection of the acting command: the newest valid one, held for a limited time."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np

from space_robot_msgs_py.samples import Command


class CommandGuard:
    """Guard of the command in force. Independent of ROS.

    A command is good if it is finite, and answers a state that has been sent and is newer than the
    one answered before.
    It acts until ``hold_ticks`` after the state it answers, however late it came; then, without a
    newer one, the torque is zero.
    """

    def __init__(self, axes: int, hold_ticks: int) -> None:
        self._hold_ticks = hold_ticks
        self._accepted, self.offered = (Command(-1, np.zeros(axes)) for _ in range(2))
        """``offered``: to be filled with a command that has come, for `accept`."""
        self._none = Command(-1, np.zeros(axes))
        self.acting = self._none
        """The command that acts at the tick last given to `act`."""
        self.refused: Counter[str] = Counter()
        """Number of refused commands by reason."""

    @property
    def answered(self) -> int:
        """Tick of the last accepted command; -1 if none."""
        return self._accepted.tick

    @property
    def is_safe(self) -> bool:
        """True if commands have failed for so long that the torque is zero."""
        return self.acting is self._none

    def held_ticks(self, now: int) -> int:
        """Return the age at ``now`` of the state that the last good command answers, ticks."""
        return now - self._accepted.tick

    def accept(self, now: int) -> bool:
        """Take the command in `offered` at tick ``now``; False, and counted, if it is not good."""
        if not self._accepted.tick < self.offered.tick <= now:
            self.refused["stamp"] += 1
            return False
        torque = self.offered.torque
        # a sum takes a third of the time of `isfinite`; finite unless a number is not, or huge
        if not (math.isfinite(sum(torque.tolist())) or np.isfinite(torque).all()):
            self.refused["not finite"] += 1
            return False
        self._accepted, self.offered = self.offered, self._accepted
        return True

    def refuse(self, reason: str) -> None:
        """Count a command that could not be read."""
        self.refused[reason] += 1

    def release(self) -> None:
        """Set the torque to zero until the next valid command."""
        self._accepted.torque[:] = 0.0

    def act(self, now: int) -> Command:
        """Return the command for tick ``now``."""
        held = self.answered >= 0 and self.held_ticks(now) <= self._hold_ticks
        self.acting = self._accepted if held else self._none
        return self.acting
