"""The columns of Table V that a flight has, their sizes at each tick, and the metrics of rows."""

from __future__ import annotations

from functools import reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.validation import one_of

from ...analysis.attitude_drift import controls_base
from ...analysis.metrics import AxisIndex, error_columns, largest_of_columns, torque_columns
from ...analysis.ripple import FAST, SHORTEST_S, SLOWEST
from ...flight.plan import Flight

Array = NDArray[np.float64]

RIPPLE, FAST_RIPPLE = "ripple_", "fast_ripple_"
"""What the names of metrics of ripple begin with; a torque column follows."""
OF_BASE = ("attitude", "base_torque")
"""Columns that are vectors: their size is the norm; joints are each for itself."""


class Columns(NamedTuple):
    """The axes that each column is of, by its name."""

    errors: dict[str, AxisIndex]
    torques: dict[str, AxisIndex]

    @classmethod
    def of_flight(cls, flight: Flight) -> Columns:
        """Return those of a flight before it is flown."""
        robot = flight.robot
        kinds = robot.n + 3, flight.controls_base, tuple(robot.is_prismatic), robot.branches
        return cls(error_columns(*kinds), torque_columns(*kinds))

    @classmethod
    def of_log(cls, log: FlightLog) -> Columns:
        """Return those of a flight's rows."""
        kinds = log.axes, controls_base(log), log.prismatic, log.branches
        return cls(error_columns(*kinds), torque_columns(*kinds))

    @property
    def names(self) -> tuple[str, ...]:
        """All columns: errors, then torques."""
        return (*self.errors, *self.torques)

    @property
    def metrics(self) -> tuple[str, ...]:
        """All metrics of a row, in the order of the table.

        ``<column>_rms``: mean over the axes of each axis' RMS, as Table V has it.
        ``<column>_max``: the largest size at any tick, see `sizes`. ``ripple_<torque column>`` and
        ``fast_ripple_<torque column>``: RMS of the ripple above 2 Hz, and above 25 Hz.
        """
        return (
            *(f"{name}_rms" for name in self.names),
            *(f"{name}_max" for name in self.names),
            *(f"{RIPPLE}{name}" for name in self.torques),
            *(f"{FAST_RIPPLE}{name}" for name in self.torques),
        )

    def check(self, metric: str, where: str) -> str:
        """Return the name of a metric that these columns have.

        Args:
            metric: its name.
            where: it stands, for the error.

        Raises:
            InputError: there is none of that name; names those there are.
        """
        return one_of(metric, self.metrics, "metric", f" in {where}")

    def sizes(self, log: FlightLog, error: Array) -> dict[str, Array]:
        """Compute the size of each column at every tick, (N,).

        Of the base it is the norm of the vector: of the error the vector part of the quaternion
        (half the angle, rad), of the torque N m. Of joints it is the largest absolute value of any.

        Args:
            log: rows of the flight.
            error: (N, n+3) their tracking error.
        """
        return {
            name: (_norms if name in OF_BASE else largest_of_columns)(values[:, axes])
            for values, columns in ((error, self.errors), (log.applied_torque, self.torques))
            for name, axes in columns.items()
        }


def missing_for_ripple(metric: str, ticks: int, period: float) -> str:
    """Return what a metric of ripple needs and a flight does not have; empty if nothing.

    Args:
        metric: any metric's name.
        ticks: of the flight, or of a window in it.
        period: s.
    """
    if not metric.startswith((RIPPLE, FAST_RIPPLE)):
        return ""
    above = FAST if metric.startswith(FAST_RIPPLE) else SLOWEST
    if 0.5 / period <= above:
        return f"needs ticks less than {0.5 / above:g} s apart, they are {period:g} s apart"
    if ticks * period < SHORTEST_S * (1.0 - 1e-9):
        return f"needs {SHORTEST_S:g} s of flight, there are {ticks * period:g} s"
    return ""


def _norms(values: Array) -> Array:
    """(N,) of rows (N, 3), by plain sums: the same bits on every machine."""
    norms: Array = np.sqrt(reduce(np.add, (values * values).T))
    return norms
