"""Metrics of a flight (Section IV-E), in both definitions, and chatter.

Equation (64) is ``sqrt(mean(x^2 + y^2 + z^2)) / 3``; Table V holds the mean of the three axes'
RMS values instead. Both are given, named ``eq64`` and ``mean_axis``.
"""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.blocks import Metric, blocks_of
from space_robot_msgs_py.bag.flight_log import FlightLog

from .spectrum import PowerAbove

Array = NDArray[np.float64]
Table = dict[str, dict[str, float]]


def axis_groups(n: int) -> dict[str, slice]:
    """Divide the n+3 axes into base, inner (1 to 3) and outer joints, by their keys' suffix."""
    groups = {"base": slice(0, 3), f"1_{min(n, 3)}": slice(3, 3 + min(n, 3))}
    if n > 3:
        groups[f"4_{n}"] = slice(6, 3 + n)
    return groups


def error_columns(axes: int) -> dict[str, slice]:
    """Return which of the m = n+3 axes each error column of Table V is of."""
    return _columns(axis_groups(axes - 3), "attitude", "joints")


def torque_columns(axes: int) -> dict[str, slice]:
    """Return which of the m = n+3 axes each torque column of Table V is of."""
    return _columns(axis_groups(axes - 3), "base_torque", "torque")


def tracking_error(log: FlightLog) -> Array:
    """Compute ``e = rho_d - rho`` (N, n+3): eps, then joints, rad; of +-Q_d the one on Q's side."""
    error = np.empty((log.ticks, log.axes))
    desired = log.reference_base[:, :4]
    side = np.where(_sum_of_columns(log.quaternion * desired) < 0.0, -1.0, 1.0)
    np.multiply(side[:, np.newaxis], desired[:, 1:], out=error[:, :3])
    error[:, :3] -= log.quaternion[:, 1:]
    np.subtract(log.reference_joints[:, 0], log.joint_positions, out=error[:, 3:])
    return error


def largest_of_columns(values: Array) -> Array:
    """Find the largest absolute value of each row, (N,), faster than NumPy over short rows."""
    return reduce(np.maximum, np.abs(values.T))


class AxisRms:
    """RMS of each axis, of rows (N, axes) that come in parts."""

    def __init__(self, axes: int) -> None:
        self.rows = 0
        self._squares = np.zeros(axes)

    def add(self, squares: Array) -> None:
        """Take the squares of further rows."""
        self.rows += len(squares)
        self._squares += np.sum(squares, axis=0)

    @property
    def value(self) -> Array:
        """(axes,)."""
        rms: Array = np.sqrt(self._squares / self.rows)
        return rms


class AxisMaximum:
    """Largest absolute value of each axis, of rows (N, axes) that come in parts."""

    def __init__(self, axes: int) -> None:
        self.value = np.zeros(axes)
        """(axes,)."""

    def add(self, values: Array) -> None:
        """Take further rows."""
        self.value = np.maximum(self.value, np.max(np.abs(values), axis=0, initial=0.0))


class Eq64:
    """(64): a third of the RMS of the vector (for other than three axes, that share of it)."""

    def __init__(self) -> None:
        self._sum, self._rows, self._axes = 0.0, 0, 1

    def add(self, squares: Array) -> None:
        """Take the squares of further rows (N, axes)."""
        self._sum += float(np.sum(_sum_of_columns(squares)))
        self._rows += len(squares)
        self._axes = squares.shape[1]

    @property
    def value(self) -> float:
        """In the unit of the axes."""
        return float(np.sqrt(self._sum / self._rows) / self._axes)


def mean_axis_rms(values: Array) -> float:
    """Mean over the axes of each axis' RMS; ``values`` (N, axes)."""
    figure = AxisRms(values.shape[1])
    figure.add(values**2)
    return float(np.mean(figure.value))


def eq64_rms(values: Array) -> float:
    """`Eq64` of ``values`` (N, axes)."""
    figure = Eq64()
    figure.add(values**2)
    return figure.value


class TotalVariation:
    """``sum |x_k+1 - x_k|`` of each axis."""

    def __init__(self, axes: int) -> None:
        self._variation, self._rows = np.zeros(axes), 0
        self._last = np.empty((0, axes))

    def add(self, values: Array) -> None:
        """Take further rows (N, axes); the step from the last row before counts."""
        steps = np.diff(values, axis=0, prepend=self._last)
        self._variation += np.sum(np.abs(steps), axis=0)
        self._last = values[-1:].copy()
        self._rows += len(values)

    def per_second(self, axes: slice, period: float) -> float:
        """Mean over some axes, per second of rows that are ``period`` s apart."""
        if self._rows < 2:
            return 0.0
        return float(np.mean(self._variation[axes]) / ((self._rows - 1) * period))


class Rms(Metric):
    """The RMS of errors and torques, by definition and column of Table V."""

    def __init__(self, axes: int) -> None:
        self._each = AxisRms(axes), AxisRms(axes)
        self._columns = error_columns(axes), torque_columns(axes)
        self._eq64 = {name: Eq64() for columns in self._columns for name in columns}

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        for each, columns, values in zip(
            self._each, self._columns, (error, log.applied_torque), strict=True
        ):
            squares = values**2
            each.add(squares)
            for name, axes in columns.items():
                self._eq64[name].add(squares[:, axes])

    def result(self) -> Table:
        """By definition and column."""
        return {
            "mean_axis": {
                name: float(np.mean(each.value[axes]))
                for each, columns in zip(self._each, self._columns, strict=True)
                for name, axes in columns.items()
            },
            "eq64": {name: eq64.value for name, eq64 in self._eq64.items()},
        }


class Maxima(Metric):
    """Largest |error| and |torque| on any axis, by column of Table V."""

    def __init__(self, axes: int) -> None:
        self._error, self._torque = AxisMaximum(axes), AxisMaximum(axes)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        self._error.add(error)
        self._torque.add(log.applied_torque)

    def result(self) -> dict[str, float]:
        """By column, in its unit."""
        axes = len(self._error.value)
        return {
            name: float(np.max(each.value[columns]))
            for each, names in (
                (self._error, error_columns(axes)),
                (self._torque, torque_columns(axes)),
            )
            for name, columns in names.items()
        }


class Chatter(Metric):
    """Measures how rough the applied torques are, by measure and column of Table V."""

    def __init__(self, axes: int, period: float) -> None:
        self._period, self._columns = period, torque_columns(axes)
        self._variation, self._power = TotalVariation(axes), PowerAbove(axes, period)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        self._variation.add(log.applied_torque)
        self._power.add(log.applied_torque)

    def result(self) -> Table:
        """By measure and column."""
        shares = self._power.shares()
        return {
            "total_variation_per_s": {
                name: self._variation.per_second(axes, self._period)
                for name, axes in self._columns.items()
            },
            "power_above_100_hz": {
                name: float(np.mean(shares[axes])) for name, axes in self._columns.items()
            },
        }


def rms(log: FlightLog) -> Table:
    """`Rms` of a whole log."""
    metric = Rms(log.axes)
    _add_all(metric, log)
    return metric.result()


def chatter(log: FlightLog) -> Table:
    """`Chatter` of a whole log."""
    metric = Chatter(log.axes, log.timebase.period)
    _add_all(metric, log)
    return metric.result()


def _add_all(metric: Metric, log: FlightLog) -> None:
    for block in blocks_of(log):
        metric.add(block, tracking_error(block))


def _columns(groups: dict[str, slice], base: str, prefix: str) -> dict[str, slice]:
    """The axes of each column, ``base`` or the suffix of the group after ``prefix``."""
    return {base if key == "base" else f"{prefix}_{key}": axes for key, axes in groups.items()}


def _sum_of_columns(values: Array) -> Array:
    """(N,), as fast as memory allows: NumPy's own sum over short rows is not."""
    return reduce(np.add, values.T)
