"""Saturation of reaction wheels: motors that give their largest torque, wheels that are full."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import WheelSettings
from space_robot_msgs_py.bag.flight_log import FlightLog, Metric
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]

ROUNDING = 1e-9
"""Share of a limit by which a number at it may miss it."""


class WheelRows(NamedTuple):
    """Rows of a flight's wheels."""

    torque: Array
    """(N, W) N m that each motor gave over the interval that ended at the tick."""
    momentum: Array
    """(N, W) N m s to which it brought its wheel by then, were there no friction."""


class WheelMotion:
    """Follows what the motors give and where they bring the wheels, block by block."""

    def __init__(self, wheels: WheelSettings) -> None:
        self._wheels = wheels
        self._before: Array | None = None
        """(1, W) N m s at the last row."""

    def add(self, log: FlightLog) -> WheelRows:
        """Take further rows.

        A motor stops at its wheel's limit whatever friction takes, and whatever the base does
        meanwhile: ``h + u T`` is what it looks at.
        """
        momentum = self._wheels.spin_momenta(log.wheel_velocities)
        before = momentum[:1] if self._before is None else self._before
        begun = np.concatenate([before, momentum[:-1]])
        reached = begun + log.wheel_torques * log.timebase.period
        if self._before is None:
            reached[0] = momentum[0]
        self._before = momentum[-1:].copy()
        return WheelRows(log.wheel_torques, reached)


class WheelSaturation(Metric):
    """Counts the ticks at which each wheel's motor gave all it can, or its wheel was full."""

    def __init__(self, log: FlightLog, wheels: WheelSettings) -> None:
        """``log``: the first rows.

        Raises:
            InputError: there are no wheels.
        """
        if not wheels.count:
            raise InputError("the base has no wheels")
        self._first_tick, self._period = log.first_tick, log.timebase.period
        self._limits = [wheels.limits(f"max_{key}") for key in ("torque", "momentum")]
        self._motion = WheelMotion(wheels)
        self._ticks = np.zeros((2, wheels.count), dtype=np.intp)
        self._first: NDArray[np.intp] = np.full(wheels.count, -1)
        """Row of the first tick at a limit; -1: there was none."""
        self._rows = self._any = 0

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        rows = self._motion.add(log)
        at_torque, at_momentum = (
            np.abs(values) >= limit * (1.0 - ROUNDING)
            for values, limit in zip(rows, self._limits, strict=True)
        )
        self._ticks += [np.sum(at_torque, axis=0), np.sum(at_momentum, axis=0)]
        at_either = at_torque | at_momentum
        first = np.where(at_either.any(axis=0), np.argmax(at_either, axis=0) + self._rows, -1)
        self._first = np.where(self._first < 0, first, self._first)
        self._any += int(np.count_nonzero(at_either.any(axis=1)))
        self._rows += log.ticks

    def result(self) -> dict[str, Any]:
        """Return the ticks at which any wheel was at a limit, and those of each by limit."""
        return {
            "ticks": self._any,
            "share": self._any / self._rows,
            "wheels": {
                f"wheel_{i + 1}": {
                    "torque_limit_ticks": int(self._ticks[0, i]),
                    "momentum_limit_ticks": int(self._ticks[1, i]),
                    "first_s": (self._first_tick + int(first)) * self._period
                    if first >= 0
                    else None,
                }
                for i, first in enumerate(self._first)
            },
        }
