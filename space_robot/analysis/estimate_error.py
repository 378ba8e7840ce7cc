"""The error of the time-delay estimate N_hat of N, from recorded motion and torque alone.

``N = F_S - h_bar rhodd`` (33) is all that the constant diagonal inertia h_bar (the gain ``h_bar``)
leaves out; ``N_hat(t) = N(t - delta)`` (35), (36). The controller forms N_hat from the pair of
`space_robot_control.controller.time_delay_estimation`: the torque *reported* for the last
interval and the mean acceleration *measured* over it. Both are in a bag, so N_hat follows without
the telemetry.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog, Metric, joined, last_rows
from space_robot_msgs_py.bag.law_history import laws_of
from space_robot_msgs_py.errors import InputError

from .attitude_drift import controls_base
from .generalised_motion import applied_force, continuous_error, mean_acceleration, measured_rows
from .metrics import AxisMaximum, AxisRms, Table, axis_groups

Array = NDArray[np.float64]
HBar = Callable[[FlightLog], Array]
"""h_bar in force in the rows of a log: (m,), or (N, m) with NaN under a law without an estimate, or
with one of the nominal inertia."""


class DelayedEstimate:
    """``N_hat`` as the controller forms it, from `generalised_motion.neglected_force` in parts.

    It is linear, so that it may be formed of force and acceleration before h_bar is known.
    """

    def __init__(self, smoothing: float = 0.0, rest: bool = True) -> None:
        """Begin without rows.

        Args:
            smoothing: weight of a new pair in the low-pass, see
                `low_pass_weight`; 0: no low-pass.
            rest: whether the rows begin at the flight's start, at rest; else the low-pass begins
                at the first row.
        """
        self._smoothing, self._rest = smoothing, rest
        self._state: Array | None = None

    def of(self, neglected: Array) -> Array:
        """(K, ...) ``N_hat`` at the ends of the intervals of ``neglected`` (K, ...)."""
        smoothing = self._smoothing
        if not (0.0 < smoothing < 1.0 and len(neglected)):
            return neglected
        from scipy.signal import lfilter  # slow to import, and hardly ever needed

        if self._state is None:
            before = np.zeros_like(neglected[:1]) if self._rest else neglected[:1]
            self._state = (1.0 - smoothing) * before
        filtered: Any = lfilter(
            [smoothing], [1.0, smoothing - 1.0], neglected, axis=0, zi=self._state
        )
        estimate: Array
        estimate, self._state = filtered
        return estimate


class Intervals:
    """Force and mean acceleration over each interval between two rows of a log in parts."""

    def __init__(self) -> None:
        self._last: FlightLog | None = None
        self._side = 1.0
        """1 if q_e continues from that of the last row with eta >= 0, -1 if from its negative."""

    def of(self, log: FlightLog) -> tuple[FlightLog, Array]:
        """Return the rows at which the new intervals begin, and one more; and (K, 2, m) of each."""
        rows = joined(self._last, log)
        error = self._side * continuous_error(rows)
        with np.errstate(divide="ignore", invalid="ignore"):  # J0 may be singular
            pairs = np.stack([applied_force(rows, error), mean_acceleration(rows, error)], axis=1)
        self._last = last_rows(log, 1)
        self._side = -1.0 if error[-1, 0] < 0.0 else 1.0
        return rows, pairs


class EstimateErrors:
    """``N - N_hat`` of a flight in parts, in the units of `generalised_motion.neglected_force`.

    N is of the true motion and the torque given, N_hat of the motion measured and the torque
    reported, as the controller had them. The error is known from the third row on, at the tick
    before. Ticks whose state was filled in (`FlightLog.filled`), and their neighbours, are left
    out: what stands there was not measured. So are ticks under a law without an estimate.
    """

    def __init__(self, h_bar: HBar, smoothing: float = 0.0, rest: bool = True) -> None:
        """``h_bar``: as `described.estimator` has it; the others as in `DelayedEstimate`."""
        self._h_bar = h_bar
        self._estimate = DelayedEstimate(smoothing, rest)
        self._true, self._told = Intervals(), Intervals()
        self._before: FlightLog | None = None
        """The last row, as measured."""
        self._measured = np.empty(0, np.bool_)
        """True for those of the last two rows that were measured."""
        self._last: Array | None = None
        """(1, 2, m) force and acceleration of the estimate at the last row."""

    def of(self, log: FlightLog) -> Array:
        """(K, m) those that become known with the rows of ``log``."""
        as_measured = log.as_measured()
        measured = np.concatenate([self._measured, measured_rows(as_measured, self._before)])
        rows, true = self._true.of(log)
        as_told = true if as_measured is log else self._told.of(as_measured)[1]
        estimates = self._estimate.of(as_told)
        if self._last is not None:
            estimates = np.concatenate([self._last, estimates])
        known = slice(len(true) - len(estimates) + 1, len(true))
        h_bar = self._h_bar(rows)
        if h_bar.ndim == 2:
            h_bar = h_bar[known]
        # force and acceleration outlast a change of law or gains, their h_bar does not
        estimate = estimates[:-1, 0] - h_bar * estimates[:-1, 1]
        error: Array = true[known, 0] - h_bar * true[known, 1] - estimate
        there = np.broadcast_to(np.isfinite(h_bar).all(axis=-1), len(error))
        if log.filled:
            there = there & measured[:-2] & measured[1:-1] & measured[2:]
        self._before, self._measured = last_rows(as_measured, 1), measured[-2:]
        self._last = estimates[-1:].copy()
        return error if there.all() else error[there]


class EstimateError(Metric):
    """RMS and largest absolute value of `EstimateErrors`, by group of axes."""

    def __init__(self, log: FlightLog, h_bar: HBar, smoothing: float) -> None:
        """``log``: the first rows; the others as in `EstimateErrors`."""
        self._errors = EstimateErrors(h_bar, smoothing, rest=log.first_tick == 0)
        self._laws: set[str] = set()
        self._has_estimate = False
        self._groups = axis_groups(log.axes - 3, controls_base(log), log.prismatic, log.branches)
        self._rms, self._maximum = AxisRms(log.axes), AxisMaximum(log.axes)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        errors = self._errors.of(log)
        for law in laws_of(log):
            self._laws.add(law.name)
            self._has_estimate |= any(law.gains.get("h_bar", ()))
        self._rms.add(errors)
        self._maximum.add(errors)

    def result(self) -> Table:
        """``rms`` and ``max`` by group."""
        if not self._rms.rows:
            if self._laws and not self._has_estimate:
                names = ", ".join(sorted(self._laws))
                raise InputError(f"{names} has no time-delay estimate with a constant h_bar")
            raise InputError("three measured states in a row are needed")
        each, largest, groups = self._rms.value, self._maximum.value, self._groups
        if not np.isfinite([each[axes].sum() for axes in groups.values()]).all():
            raise InputError("the attitude's error was 180 degrees, where J0 of (1) is singular")
        return {
            "rms": {name: float(np.mean(each[axes])) for name, axes in groups.items()},
            "max": {name: float(np.max(largest[axes])) for name, axes in groups.items()},
        }
