"""Which faults act at a tick, and what chance decides there."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import InputError

from .catalogue import Fault

Array = NDArray[np.float64]

BLOCK_TICKS = 256
"""Ticks whose random numbers are drawn at once."""


class ScheduledFault:
    """A fault in ticks, with its own random numbers.

    These are a function of seed, index and tick alone: a run repeats exactly, asking twice gives
    the same, and no fault's numbers depend on the faults beside it.
    """

    def __init__(self, fault: Fault, index: int, seed: int, period: float) -> None:
        """Place ``fault``, the ``index``-th of the flight.

        Raises:
            InputError: it ends before the first tick it could act at.
        """
        self.kind, self.value, self.joint = fault.kind, fault.value, fault.joint
        self.first = _tick_from(fault.start_s, period)
        """Tick from which it acts."""
        self.stop = _tick_from(fault.stop_s, period)
        """Tick from which it no longer acts (inf: it lasts)."""
        if not self.first < self.stop:
            raise InputError(f"fault '{fault}': there is no tick of {period:g} s in that time")
        self._key = (seed, index)
        self._block = -1
        self._rows = np.empty((0, 0))

    def acts_at(self, tick: int) -> bool:
        """Whether ``tick`` is within its time."""
        return self.first <= tick < self.stop

    def happens_at(self, tick: int) -> bool:
        """Whether it acts and chance, with its value as probability, will have it."""
        return self.acts_at(tick) and bool(self._row(tick, 2, normal=False)[0] < self.value)

    def choose(self, tick: int, count: int) -> int:
        """One of ``range(count)``, any as likely; independent of `happens_at`."""
        return int(self._row(tick, 2, normal=False)[1] * count)

    def noise(self, tick: int, size: int) -> Array:
        """Normal numbers (size,) with its value as standard deviation."""
        return self.value * self._row(tick, size, normal=True)

    def _row(self, tick: int, size: int, normal: bool) -> Array:
        block, row = divmod(tick, BLOCK_TICKS)
        if block != self._block:
            rng = np.random.default_rng((*self._key, block))
            draw = rng.standard_normal if normal else rng.random
            self._rows, self._block = draw((BLOCK_TICKS, size)), block
        numbers: Array = self._rows[row]
        return numbers


class Schedule:
    """The faults of a flight in the order given, each seeded by ``seed`` and its place."""

    def __init__(self, faults: Sequence[Fault], seed: int, period: float) -> None:
        """Place all.

        Raises:
            InputError: see `ScheduledFault`.
        """
        self.faults = [
            ScheduledFault(fault, index, seed, period) for index, fault in enumerate(faults)
        ]

    def of(self, *kinds: str) -> list[ScheduledFault]:
        """Those of the given kinds."""
        return [fault for fault in self.faults if fault.kind in kinds]


def _tick_from(seconds: float, period: float) -> float:
    """The first tick at or after a time; a millionth of a tick counts as rounding."""
    return math.ceil(seconds / period - 1e-6) if math.isfinite(seconds) else seconds
