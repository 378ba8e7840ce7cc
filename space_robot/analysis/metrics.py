"""Metrics of a flight (Section IV-E), in both definitions, and chatter.

Equation (64) is ``sqrt(mean(x^2 + y^2 + z^2)) / 3``; Table V holds the mean of the three axes'
RMS values instead. Both are given, named ``eq64`` and ``mean_axis``.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import attitude_error_into
from space_robot_model.elementary.matrices import dot_rows, norm
from space_robot_msgs_py.bag.flight_log import FlightLog, Metric, blocks_of
from space_robot_msgs_py.compiled.kernels import kernel

from .spectrum import PowerAbove

Array = NDArray[np.float64]
Table = dict[str, dict[str, float]]
AxisIndex = slice | list[int]
"""Some of the n+3 axes, as an index."""
UNITS = {
    "attitude_drift": "rad",
    "attitude_deg": "deg",
    "half_cone_arcsec": "arcsec",
    "about_arcsec": "arcsec",
    "attitude": "-",
    "joints_prismatic": "m",
    "joints": "rad",
    "base_torque": "N m",
    "torque": "N m",
    "force": "N",
    "tool_rotation": "rad",
    "tool": "m",
}
"""By the beginning of a column's name; the first that fits holds."""


def axis_groups(
    n: int, controls_base: bool = True, prismatic: Sequence[bool] = (), branches: Sequence[int] = ()
) -> dict[str, AxisIndex]:
    """Divide the n+3 axes into the base and groups of joints, by their keys' suffix.

    Those of one arm are inner (1 to 3) and outer joints; where there are several ``branches`` on
    the base, each of so many joints, a branch is a group. Joints are divided by their kind instead
    if some are ``prismatic`` (of n joints at least, or empty: none is), for no number may be of rad
    and of m. The base is no group of a flight in which nothing turns it.
    """
    groups: dict[str, AxisIndex] = {"base": slice(0, 3)} if controls_base else {}
    if any(prismatic[:n]):
        for key, is_prismatic in (("revolute", False), ("prismatic", True)):
            joints = [3 + joint for joint in range(n) if prismatic[joint] == is_prismatic]
            groups |= {key: joints} if joints else {}
        return groups
    if len(branches) > 1:
        first = 1
        for count in branches:
            last = first + count - 1
            groups[f"{first}_{last}" if count > 1 else f"{first}"] = slice(first + 2, last + 3)
            first = last + 1
        return groups
    groups[f"1_{min(n, 3)}"] = slice(3, 3 + min(n, 3))
    if n > 3:
        groups[f"4_{n}"] = slice(6, 3 + n)
    return groups


def error_columns(
    axes: int,
    controls_base: bool = True,
    prismatic: Sequence[bool] = (),
    branches: Sequence[int] = (),
) -> dict[str, AxisIndex]:
    """Return which of the m = n+3 axes each error column of Table V is of."""
    groups = axis_groups(axes - 3, controls_base, prismatic, branches)
    return {
        "attitude" if k == "base" else f"joints_{k}": axes_of_group
        for k, axes_of_group in groups.items()
    }


def torque_columns(
    axes: int,
    controls_base: bool = True,
    prismatic: Sequence[bool] = (),
    branches: Sequence[int] = (),
) -> dict[str, AxisIndex]:
    """Return which of the m = n+3 axes each torque column of Table V is of."""
    groups = axis_groups(axes - 3, controls_base, prismatic, branches)
    names = {"base": "base_torque", "prismatic": "force_prismatic"}
    return {names.get(k, f"torque_{k}"): axes_of_group for k, axes_of_group in groups.items()}


def unit_of(column: str) -> str:
    """Return the unit of a column of `error_columns` or `torque_columns`."""
    return next(unit for prefix, unit in UNITS.items() if column.startswith(prefix))


def tracking_error(log: FlightLog) -> Array:
    """Compute ``e = rho_d - rho = [-eps_e, theta_d - theta]`` (N, n+3): -, then rad or m.

    ``eps_e`` is the vector part of `attitude_error`.
    """
    error = np.empty((log.ticks, log.axes))
    error[:, 3:] = log.reference_joints[:, 0]
    error[:, 3:] -= log.joint_positions
    np.subtract(0.0, attitude_error(log)[:, 1:], out=error[:, :3])
    return error


def attitude_error(log: FlightLog) -> Array:
    """Compute ``q_e = q_d* (x) q`` (N, 4), the rotation from the desired attitude to the true one.

    Of +-q_e it is the one with eta >= 0. Its vector part is the same on the axes of both frames.
    """
    return relative_attitude(log.reference_base, log.quaternion)


def relative_attitude(first: Array, second: Array) -> Array:
    """Compute ``first* (x) second`` (N, 4), of quaternions ``[w, x, y, z]``; eta >= 0.

    Args:
        first: (N, 4 or more) columns after the fourth are ignored.
        second: (N, 4).
    """
    error = np.zeros((len(second), 4))
    _relative_attitudes(np.ascontiguousarray(first), np.ascontiguousarray(second), error)
    return error


@kernel
def _relative_attitudes(first: Array, second: Array, out: Array) -> None:
    for i in range(len(out)):
        attitude_error_into(first[i], second[i], out[i])


def attitude_angles(log: FlightLog) -> Array:
    """Compute the error of the attitude, (N, 3) deg: the rotation vector of ``q_e*``.

    Like `tracking_error` it is that of the desired attitude less the true one.
    """
    angles: Array = -np.degrees(rotation_vectors(attitude_error(log)))
    return angles


def angles_of(eps: Array) -> Array:
    """Compute rotation vectors (N, 3), deg, of the vector parts (N, 3) of quaternions."""
    angles: Array = np.degrees(rotation_vectors(quaternions_of(eps)))
    return angles


def quaternions_of(eps: Array) -> Array:
    """Return the unit quaternions (N, 4) with the vector parts (N, 3), and eta >= 0."""
    return np.hstack([np.sqrt(np.maximum(1.0 - dot_rows(eps, eps), 0.0)), eps])


def rotation_vectors(quaternions: Array) -> Array:
    """Compute the rotation vectors (N, 3), rad, of quaternions (N, 4) with eta >= 0."""
    vectors = quaternions[:, 1:]
    sine = np.linalg.norm(vectors, axis=1)
    angle, is_turned = 2.0 * np.arctan2(sine, quaternions[:, 0]), sine > 0.0
    rotations: Array = np.divide(angle, sine, out=np.full_like(sine, 2.0), where=is_turned)
    return rotations[:, np.newaxis] * vectors


def largest_of_columns(values: Array) -> Array:
    """Find the largest absolute value of each row, (N,), faster than NumPy over short rows."""
    return reduce(np.maximum, np.abs(values.T))


class AxisRms:
    """RMS of each axis, of rows (N, axes) that come in parts."""

    def __init__(self, axes: int) -> None:
        self.rows = 0
        self._squares = np.zeros(axes)

    def add(self, values: Array) -> None:
        """Take further rows."""
        self.rows += len(values)
        self._squares += np.einsum("ij,ij->j", values, values)

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


def eq64(each: Array) -> float:
    """Compute (64) of the axes' RMS values (axes,): a third of the RMS of the vector.

    Of other than three axes it is that share of it.
    """
    return norm(each) / len(each)


class TotalVariation:
    """``sum |x_k+1 - x_k|`` of each axis."""

    def __init__(self, axes: int) -> None:
        self._variation, self._rows = np.zeros(axes), 0
        self._last: Array = np.empty((0, axes))

    def add(self, values: Array) -> None:
        """Take further rows (N, axes); the step from the last row before counts."""
        steps = np.diff(values, axis=0, prepend=self._last)
        self._variation += np.sum(np.abs(steps), axis=0)
        self._last = values[-1:].copy()
        self._rows += len(values)

    def per_second(self, axes: AxisIndex, period: float) -> float:
        """Mean over some axes, per second of rows that are ``period`` s apart."""
        if self._rows < 2:
            return 0.0
        return float(np.mean(self._variation[axes]) / ((self._rows - 1) * period))


class Rms(Metric):
    """The RMS of errors and torques, by definition and column of Table V."""

    def __init__(
        self,
        axes: int,
        controls_base: bool = True,
        prismatic: Sequence[bool] = (),
        branches: Sequence[int] = (),
    ) -> None:
        self._error, self._torque = AxisRms(axes), AxisRms(axes)
        self._kinds = controls_base, prismatic, branches

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        self._error.add(error)
        self._torque.add(log.applied_torque)

    def result(self) -> Table:
        """By definition and column."""
        error, torque = self._error.value, self._torque.value
        return {
            "mean_axis": _by_column(error, torque, np.mean, *self._kinds),
            "eq64": _by_column(error, torque, eq64, *self._kinds),
        }


class Maxima(Metric):
    """Largest |error| and |torque| on any axis, by column of Table V."""

    def __init__(
        self,
        axes: int,
        controls_base: bool = True,
        prismatic: Sequence[bool] = (),
        branches: Sequence[int] = (),
    ) -> None:
        self._error, self._torque = AxisMaximum(axes), AxisMaximum(axes)
        self._kinds = controls_base, prismatic, branches

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        self._error.add(error)
        self._torque.add(log.applied_torque)

    def result(self) -> dict[str, float]:
        """By column, in its unit."""
        return _by_column(self._error.value, self._torque.value, np.max, *self._kinds)


class AttitudeError(Metric):
    """The angles of the attitude's error, degrees, by the definitions of `Rms` and `Maxima`.

    They are the components of `attitude_angles`.
    """

    def __init__(self) -> None:
        self._rms, self._maximum = AxisRms(3), AxisMaximum(3)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        angles = attitude_angles(log)
        self._rms.add(angles)
        self._maximum.add(angles)

    def result(self) -> dict[str, float]:
        """``mean_axis``, ``eq64`` and ``max``."""
        rms = self._rms.value
        return {
            "mean_axis": float(np.mean(rms)),
            "eq64": eq64(rms),
            "max": float(np.max(self._maximum.value)),
        }


class Chatter(Metric):
    """Measures how rough the applied torques are, by measure and column of Table V."""

    def __init__(
        self,
        axes: int,
        period: float,
        controls_base: bool = True,
        prismatic: Sequence[bool] = (),
        branches: Sequence[int] = (),
    ) -> None:
        self._period = period
        self._columns = torque_columns(axes, controls_base, prismatic, branches)
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


def of_log(metric: Metric, log: FlightLog) -> Any:
    """Return the result of a metric without rows, of a whole log."""
    for block in blocks_of(log):
        metric.add(block, tracking_error(block))
    return metric.result()


def _by_column(
    error: Array,
    torque: Array,
    figure: Callable[[Array], Any],
    controls_base: bool,
    prismatic: Sequence[bool],
    branches: Sequence[int],
) -> dict[str, float]:
    """Sum up the numbers of the axes, (m,) each, in every column of Table V."""
    return {
        name: float(figure(values[axes]))
        for values, columns in (
            (error, error_columns(len(error), controls_base, prismatic, branches)),
            (torque, torque_columns(len(torque), controls_base, prismatic, branches)),
        )
        for name, axes in columns.items()
    }
