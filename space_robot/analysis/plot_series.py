"""The series that figures of several flights plot of each; the flights need not stay in memory."""

from __future__ import annotations

from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from .attitude_drift import controls_base
from .described import event_times, robot_of
from .metrics import AxisIndex, attitude_angles, error_columns, torque_columns, tracking_error
from .pointing import (
    BasePointingError,
    PointingBudget,
    PointingError,
    base_pointing_error,
    pointing_error,
    pointing_of,
)
from .ripple import RippleSpectrum, ripple_spectrum
from .waypoints import junction_ticks

Array = NDArray[np.float64]


def tick_times(log: FlightLog) -> Array:
    """Return the times of the ticks of a log, (N,) s."""
    ticks = log.first_tick + np.arange(log.ticks, dtype=np.float64)
    return ticks * log.timebase.period


class BaseTorque(NamedTuple):
    """The base's torque over a flight: a fiftieth of its log, to hand from process to process."""

    torque: Array
    """(N, 3) N m, applied in the base frame."""
    period: float
    """s, of a tick."""
    junctions: NDArray[np.intp]
    """Rows at which one motion has ended and another begins."""
    start: float = 0.0
    """s, time of the first row: not 0 in an excerpt of a flight."""

    @classmethod
    def of(cls, log: FlightLog) -> Self:
        """Copy it from a whole flight or an excerpt."""
        period = log.timebase.period
        return cls(
            log.applied_torque[:, :3].copy(), period, junction_ticks(log), log.first_tick * period
        )

    @property
    def time(self) -> Array:
        """Times of the rows, (N,) s."""
        return self.start + np.arange(len(self.torque), dtype=np.float64) * self.period

    @property
    def end(self) -> float:
        """End of the flight, s."""
        return self.start + len(self.torque) * self.period


class PlotSeries(NamedTuple):
    """Sizes of a flight's errors and torques over time, and its base torque itself."""

    time: Array
    """(N,) s."""
    errors: dict[str, Array]
    """(N,) norm of the error of each column of Table V, in its unit; of the attitude in degrees."""
    torques: dict[str, Array]
    """(N,) norm of the torque of each column of Table V, in its unit."""
    base_torque: BaseTorque | None
    """None where nothing turned the base."""
    pointing: PointingError | None
    """None where the robot is not known."""
    base_pointing: BasePointingError | None
    """None where nothing turned the base."""
    latency_ms: Array | None
    """(K,) of every answer, by the wall clock; None for flights without any."""
    ripple: RippleSpectrum | None
    """None where the robot is not known, or the flight is too short."""
    torque_axes: dict[str, AxisIndex]
    """The axes that each column of ``torques`` is of."""
    events: Array
    """Times of what was captured and released, s."""

    @classmethod
    def of(cls, log: FlightLog, budget: PointingBudget | None = None) -> Self:
        """Compute them from a whole flight or an excerpt.

        ``budget``: of the base's pointing; None: the default.
        """
        axis = np.array((budget or PointingBudget()).of(*pointing_of(log)).axis)
        error, axes, of_base = tracking_error(log), log.axes, controls_base(log)
        pointing = ripple = None
        with suppress(InputError):
            pointing = pointing_error(log, robot_of(log))
            ripple = ripple_spectrum(log, robot_of(log))
        latency = None
        if log.latency_s is not None:
            known = log.latency_s[np.isfinite(log.latency_s)]
            latency = 1e3 * known if len(known) else None
        errors = _norms(error, error_columns(axes, of_base, log.prismatic, log.branches))
        if of_base:
            angle = np.linalg.norm(attitude_angles(log), axis=1)
            errors = {"attitude_deg": angle} | {k: v for k, v in errors.items() if k != "attitude"}
        torque_axes = torque_columns(axes, of_base, log.prismatic, log.branches)
        return cls(
            tick_times(log),
            errors,
            _norms(log.applied_torque, torque_axes),
            BaseTorque.of(log) if of_base else None,
            pointing,
            base_pointing_error(log, axis) if of_base else None,
            latency,
            ripple,
            torque_axes,
            event_times(log),
        )


def _norms(values: Array, columns: dict[str, AxisIndex]) -> dict[str, Array]:
    return {name: np.linalg.norm(values[:, axes], axis=1) for name, axes in columns.items()}
