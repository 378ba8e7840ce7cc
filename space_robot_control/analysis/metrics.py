"""Figures of merit of a flight (Section IV-E), in both definitions, and chatter.

Equation (64) is ``sqrt(mean(x^2 + y^2 + z^2)) / 3``; Table V holds the mean of the three axes'
RMS values instead. Both are given, named ``eq64`` and ``mean_axis``.
"""

from __future__ import annotations

from functools import reduce

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.flight_log import FlightLog

Array = NDArray[np.float64]

CHATTER_FREQUENCY = 100.0
"""Hz; power above it is chatter."""
LONG = 200_000
"""Samples from which on the spectrum is of the next length that is fast, padded with zeros."""


def axis_groups(n: int) -> dict[str, slice]:
    """Base, inner (1 to 3) and outer joints of the n+3 axes, by the suffix of their keys."""
    groups = {"base": slice(0, 3), f"1_{min(n, 3)}": slice(3, 3 + min(n, 3))}
    if n > 3:
        groups[f"4_{n}"] = slice(6, 3 + n)
    return groups


def tracking_error(log: FlightLog) -> Array:
    """(N, n+3) ``e = rho_d - rho``: eps, then joints; of +-Q_d the one on Q's side."""
    error = np.empty((log.ticks, log.axes))
    desired = log.reference_base[:, :4]
    side = np.where(_sum_of_columns(log.quaternion * desired) < 0.0, -1.0, 1.0)
    np.multiply(side[:, np.newaxis], desired[:, 1:], out=error[:, :3])
    error[:, :3] -= log.quaternion[:, 1:]
    np.subtract(log.reference_joints[:, 0], log.joint_positions, out=error[:, 3:])
    return error


def axis_rms(values: Array) -> Array:
    """Each axis' RMS; ``values`` (N, axes)."""
    rms: Array = np.sqrt(np.mean(values**2, axis=0))
    return rms


def mean_axis_rms(values: Array) -> float:
    """Mean over the axes of each axis' RMS; ``values`` (N, axes)."""
    return float(np.mean(axis_rms(values)))


def eq64_rms(values: Array) -> float:
    """(64): a third of the RMS of the vector (for other than three axes, that share of it)."""
    return float(np.sqrt(np.mean(_sum_of_columns(values**2))) / values.shape[1])


def total_variation_per_second(values: Array, period: float) -> float:
    """Mean over the axes of ``sum |x_k+1 - x_k|`` per second."""
    if len(values) < 2:
        return 0.0
    variation = np.sum(np.abs(np.diff(values, axis=0)), axis=0)
    return float(np.mean(variation) / ((len(values) - 1) * period))


def power_above(values: Array, period: float, frequency: float = CHATTER_FREQUENCY) -> float:
    """Mean over the axes of the share of power above ``frequency`` Hz (Hann window)."""
    if len(values) < 2 or 0.5 / period <= frequency:
        return 0.0
    window = np.hanning(len(values))[:, np.newaxis]  # keeps slow motion from leaking upwards
    length = _transform_length(len(values))
    power = np.abs(np.fft.rfft(window * values, length, axis=0)) ** 2
    f = np.fft.rfftfreq(length, period)
    power[(f > 0.0) & (f < 0.5 / period * (1.0 - 1e-12))] *= 2.0  # the negative frequencies' half
    total = np.sum(power, axis=0)
    high = np.sum(power[f > frequency], axis=0)
    return float(np.mean(np.divide(high, total, out=np.zeros_like(high), where=total > 0.0)))


def _transform_length(samples: int) -> int:
    """``samples``, or a little more where that is long: a prime takes five times as long."""
    if samples < LONG:
        return samples
    from scipy.fft import next_fast_len  # half a second to import

    return int(next_fast_len(samples, real=True))


def rms(log: FlightLog) -> dict[str, dict[str, float]]:
    """The RMS of errors and torques, by definition and column of Table V."""
    found: dict[str, dict[str, float]] = {"mean_axis": {}, "eq64": {}}
    for values, names in (
        (tracking_error(log), error_columns(log.axes)),
        (log.applied_torque, torque_columns(log.axes)),
    ):
        each = axis_rms(values)
        for name, axes in names.items():
            found["mean_axis"][name] = float(np.mean(each[axes]))
            found["eq64"][name] = eq64_rms(values[:, axes])
    return found


def chatter(log: FlightLog) -> dict[str, dict[str, float]]:
    """How rough the torques are, by measure and column of Table V."""
    torques = {name: log.applied_torque[:, axes] for name, axes in torque_columns(log.axes).items()}
    period = log.timebase.period
    return {
        "total_variation_per_s": {
            name: total_variation_per_second(torque, period) for name, torque in torques.items()
        },
        "power_above_100_hz": {
            name: power_above(torque, period) for name, torque in torques.items()
        },
    }


def maxima(log: FlightLog) -> dict[str, float]:
    """Largest |error| and |torque| on any axis, by column of Table V, in its unit."""
    found: dict[str, float] = {}
    for values, names in (
        (tracking_error(log), error_columns(log.axes)),
        (log.applied_torque, torque_columns(log.axes)),
    ):
        each = np.max(np.abs(values), axis=0)
        found |= {name: float(np.max(each[axes])) for name, axes in names.items()}
    return found


def error_columns(axes: int) -> dict[str, slice]:
    """Which of the m = n+3 axes each error column of Table V is of."""
    return _columns(axis_groups(axes - 3), "attitude", "joints")


def torque_columns(axes: int) -> dict[str, slice]:
    """Which of the m = n+3 axes each torque column of Table V is of."""
    return _columns(axis_groups(axes - 3), "base_torque", "torque")


def _columns(groups: dict[str, slice], base: str, prefix: str) -> dict[str, slice]:
    """The axes of each column, ``base`` or the suffix of the group after ``prefix``."""
    return {base if key == "base" else f"{prefix}_{key}": axes for key, axes in groups.items()}


def _sum_of_columns(values: Array) -> Array:
    """(N,), as fast as memory allows: NumPy's own sum over short rows is not."""
    return reduce(np.add, values.T)
