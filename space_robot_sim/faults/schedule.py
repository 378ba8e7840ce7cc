"""Schedule of the faults of a flight in ticks, each with its own random numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotNames
from space_robot_msgs_py.simulated_time import tick_from

from .grammar import About, Fault, axes_of

Array = NDArray[np.float64]

NO_NAMES = RobotNames(())
BLOCK_TICKS = 256
"""Ticks for which random numbers are drawn at once."""


class ScheduledFault:
    """A fault in ticks, with its own random numbers.

    These are a function of seed, index and tick alone: a run repeats exactly, asking twice gives
    the same, and no fault's numbers depend on the faults beside it.
    """

    def __init__(
        self, fault: Fault, index: int, seed: int, period: float, names: RobotNames = NO_NAMES
    ) -> None:
        """Place ``fault``, the ``index``-th of the flight of a robot with these names."""
        self.kind, self.value = fault.kind, fault.value
        self.axes: tuple[int, ...] = ()
        """Places of what it is about: of axes 0 to 2 of the base, then the joints; of wheels or
        thrusters among their like."""
        if fault.kind.group:
            self.axes = axes_of(fault.kind.group, About.AXIS, names)
        elif fault.kind.argument and (about := fault.kind.argument.about):
            try:
                self.axes = axes_of(fault.axis, about, names)
            except InputError as error:
                raise InputError(f"fault '{fault}': {error}") from None
        self.first = tick_from(fault.start_s, period)
        """Tick from which it acts."""
        self.stop = tick_from(fault.stop_s, period)
        """Tick from which it no longer acts (inf: it lasts)."""
        if not self.first < self.stop:
            raise InputError(f"fault '{fault}': there is no tick of {period:g} s in that time")
        self._key = (seed, index)
        self._block = -1
        self._rows: Array = np.empty((0, 0))

    def acts_at(self, tick: int) -> bool:
        """Return whether ``tick`` is within the fault's time."""
        return self.first <= tick < self.stop

    def happens_at(self, tick: int) -> bool:
        """Return whether the fault acts and its draw is below its value, a probability."""
        return self.acts_at(tick) and bool(self._draw(tick)[0] < self.value)

    def choose(self, tick: int, count: int) -> int:
        """Draw one of ``range(count)``, any as likely; independent of `happens_at`."""
        return int(self._draw(tick)[1] * count)

    def _draw(self, tick: int) -> Array:
        block, row = divmod(tick, BLOCK_TICKS)
        if block != self._block:
            # a generator for each block: its numbers do not depend on the ticks asked for before
            rng = np.random.default_rng((*self._key, block))
            self._rows, self._block = rng.random((BLOCK_TICKS, 2)), block
        numbers: Array = self._rows[row]
        return numbers


class Schedule:
    """Faults of a flight in the order of the user, each seeded by ``seed`` and its index."""

    def __init__(
        self, faults: Sequence[Fault], seed: int, period: float, names: RobotNames = NO_NAMES
    ) -> None:
        """Place all faults; ``names``: of what the robot has, for faults that name one."""
        self.faults = [
            ScheduledFault(fault, index, seed, period, names) for index, fault in enumerate(faults)
        ]

    def of(self, *kinds: str) -> list[ScheduledFault]:
        """Return the faults of the kinds of these names, in the order of the flight."""
        return [fault for fault in self.faults if fault.kind.name in kinds]
