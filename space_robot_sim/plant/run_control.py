"""Up to which tick a plant may go: it runs, is paused, or is stepped."""

from __future__ import annotations

import math

from space_robot_msgs_py.errors import InputError

PAUSED = "paused"
"""The mode of a paused plant in its diagnostics."""


class RunControl:
    """Holds the plant at a tick. Independent of ROS.

    A plant that is held has sent its state and taken the answer to it; it does not integrate. So a
    flight that was paused and stepped has the states and commands of one that was not.
    """

    def __init__(self, is_paused: bool = False) -> None:
        """Run; or, if it ``is_paused``, hold the plant at tick 0."""
        self._hold_at: float = 0 if is_paused else math.inf
        self.tick = 0
        """The present one."""
        self.is_at_rest = False
        """True if the plant must stay at the present tick."""

    @property
    def is_paused(self) -> bool:
        """True from a pause until the plant runs on, also while it is stepped."""
        return self._hold_at < math.inf

    @property
    def is_held(self) -> bool:
        """True if it is paused and where it should be, with nothing left to do at this tick."""
        return self.is_at_rest and self.tick >= self._hold_at

    def begin(self, tick: int) -> None:
        """Let ``tick`` be the present one."""
        self.tick, self.is_at_rest = tick, False

    def holds(self) -> bool:
        """Tell, when all else is done, whether the plant must not leave the present tick."""
        self.is_at_rest = self.is_at_rest or self.tick >= self._hold_at
        return self.tick >= self._hold_at

    def pause(self) -> bool:
        """Hold the plant at the present tick, even within a step; False if it is paused there."""
        if self.tick >= self._hold_at:
            return False
        self._hold_at = self.tick
        return True

    def resume(self) -> bool:
        """Let the plant run on; False if it was not paused."""
        was_paused = self.is_paused
        self._hold_at = math.inf
        return was_paused

    def step(self, ticks: int) -> int:
        """Let the plant go so many ``ticks`` on; return the tick at which it is held then.

        Raises:
            InputError: it is not paused, or still in a step, or that is no number of ticks.
        """
        if ticks < 1:
            raise InputError(f"a step takes 1 tick or more, got {ticks}")
        if not self.is_paused:
            raise InputError("it is not paused: only a paused simulation can be stepped")
        if self.tick < self._hold_at:
            raise InputError(f"a step to tick {self._hold_at} is under way")
        self._hold_at = self.tick + ticks
        return self.tick + ticks
