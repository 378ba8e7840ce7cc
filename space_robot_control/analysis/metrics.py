"""Figures of merit of a flight (Section IV-E), in both definitions, and chatter.

Equation (64) is ``sqrt(mean(x^2 + y^2 + z^2)) / 3``; Table V holds the mean of the three axes'
RMS values instead. Both are given, named ``eq64`` and ``mean_axis``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.flight_log import FlightLog

Array = NDArray[np.float64]

CHATTER_FREQUENCY = 100.0
"""Hz; power above it is chatter."""


def axis_groups(n: int) -> dict[str, slice]:
    """Base, inner (1 to 3) and outer joints of the n+3 axes, by the suffix of their keys."""
    groups = {"base": slice(0, 3), f"1_{min(n, 3)}": slice(3, 3 + min(n, 3))}
    if n > 3:
        groups[f"4_{n}"] = slice(6, 3 + n)
    return groups


def tracking_error(log: FlightLog) -> Array:
    """(N, n+3) ``e = rho_d - rho``: eps, then joints; of +-Q_d the one on Q's side."""
    side = np.where(np.sum(log.quaternion * log.reference_base[:, :4], axis=1) < 0.0, -1.0, 1.0)
    attitude = side[:, np.newaxis] * log.reference_base[:, 1:4] - log.quaternion[:, 1:]
    return np.hstack([attitude, log.reference_joints[:, 0] - log.joint_positions])


def mean_axis_rms(values: Array) -> float:
    """Mean over the axes of each axis' RMS; ``values`` (N, axes)."""
    return float(np.mean(np.sqrt(np.mean(values**2, axis=0))))


def eq64_rms(values: Array) -> float:
    """(64): a third of the RMS of the vector (for other than three axes, that share of it)."""
    return float(np.sqrt(np.mean(np.sum(values**2, axis=1))) / values.shape[1])


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
    power = np.abs(np.fft.rfft(window * values, axis=0)) ** 2
    f = np.fft.rfftfreq(len(values), period)
    power[(f > 0.0) & (f < 0.5 / period * (1.0 - 1e-12))] *= 2.0  # the negative frequencies' half
    total = np.sum(power, axis=0)
    high = np.sum(power[f > frequency], axis=0)
    return float(np.mean(np.divide(high, total, out=np.zeros_like(high), where=total > 0.0)))


def analyse(log: FlightLog) -> dict[str, Any]:
    """The flight's report, the same from a graph flight, an in-process one, or a bag."""
    error, torque, period = tracking_error(log), log.applied_torque, log.timebase.period
    groups = axis_groups(log.axes - 3)

    def over(values: Array, prefix: str, base_key: str, measure: Callable[[Array], float]) -> Any:
        keys = {key: base_key if key == "base" else f"{prefix}_{key}" for key in groups}
        return {keys[key]: measure(values[:, axes]) for key, axes in groups.items()}

    def merit(measure: Callable[[Array], float]) -> Any:
        return {
            **over(error, "joints", "attitude", measure),
            **over(torque, "torque", "base_torque", measure),
        }

    def chatter(measure: Callable[[Array, float], float]) -> Any:
        return over(torque, "torque", "base_torque", lambda x: measure(x, period))

    return {
        "controller": log.flight.get("controller"),
        "case": log.flight.get("case"),
        "gains": log.flight.get("gains"),
        "robot": log.flight.get("robot"),
        "ticks": log.ticks,
        "duration_s": log.ticks * log.timebase.period_ns / 1e9,
        "rms": {"mean_axis": merit(mean_axis_rms), "eq64": merit(eq64_rms)},
        "chatter": {
            "total_variation_per_s": chatter(total_variation_per_second),
            "power_above_100_hz": chatter(power_above),
        },
        "lost": log.lost,
        "unanswered_ticks": log.unanswered,
    }
