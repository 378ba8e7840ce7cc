"""Faults of sensors: temporary changes of the parameters of a sensor's model."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..faults.grammar import Argument, Kind
from ..faults.schedule import Schedule, ScheduledFault, TemporaryChange

Array = NDArray[np.float64]
Change = Callable[[Array, ScheduledFault], None]

SIGMA_RAD = Argument("SIGMA", "rad", 0.0, 1e3)
SIGMA_RAD_PER_S = Argument("SIGMA", "rad/s", 0.0, 1e3)
STEP_RAD = Argument("STEP", "rad", 1e-12, 1e3)
STEP_RAD_PER_S = Argument("STEP", "rad/s", 1e-12, 1e3)


class SensorFault:
    """Base class of the faults of a sensor, one subclass per sensor."""

    CHANGES: ClassVar[Mapping[str, Mapping[Kind, Change]]]
    """Change of the sensor's record by each kind of fault, by the array's name."""

    KINDS: ClassVar[tuple[Kind, ...]]
    """All of these kinds."""

    def __init_subclass__(cls) -> None:
        kinds = (kind for changes in cls.CHANGES.values() for kind in changes)
        cls.KINDS = tuple(dict.fromkeys(kinds))

    def __init__(self, schedule: Schedule) -> None:
        self._changes = [
            (field, _by_kind(changes), TemporaryChange(schedule.of(*changes)))
            for field, changes in self.CHANGES.items()
        ]

    def apply(self, tick: int, part: Any) -> None:
        """Apply the faults to the sensor's record at ``tick``, or restore it."""
        for field, change, temporary in self._changes:
            temporary.apply(tick, getattr(part, field), change)


def _by_kind(changes: Mapping[Kind, Change]) -> Change:
    return partial(_change, changes)


def _change(changes: Mapping[Kind, Change], values: Array, fault: ScheduledFault) -> None:
    changes[fault.kind](values, fault)


def add_noise(sigma: Array, fault: ScheduledFault) -> None:
    """Add a fault's white noise to the standard deviation ``sigma`` in quadrature."""
    np.sqrt(sigma * sigma + fault.value * fault.value, out=sigma)


def coarsen(step: Array, fault: ScheduledFault) -> None:
    """Replace a finer quantisation by the fault's."""
    np.maximum(step, fault.value, out=step)
