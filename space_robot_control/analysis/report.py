"""All figures of merit of a flight in one dictionary, ready for JSON."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.flight_log import FlightLog

from .actuation import TorqueLimits, differing_commands, latency, saturated_ticks
from .described import NotDescribedError, estimator, robot_of, torque_limits
from .estimate_error import estimate_error
from .metrics import axis_groups, axis_rms, chatter, error_columns, maxima, rms, tracking_error
from .pointing import PointingError, pointing_error
from .settling import BAND, last_waypoint, settling_time

Array = NDArray[np.float64]


def analyse(log: FlightLog) -> dict[str, Any]:
    """The flight's report, the same from a graph flight, an in-process one, or a bag.

    A figure that this flight does not have is None; ``unavailable`` says why, by its key. Of a
    flight with gaps (a broken bag) the longest stretch without one is analysed; ``damage`` says so.

    Raises:
        InputError: no tick has both a state and a reference.
    """
    log = _without_gaps(log)
    period, flight = log.timebase.period, log.flight
    report: dict[str, Any] = {
        "controller": flight.get("controller"),
        "case": flight.get("case"),
        "gains": flight.get("gains"),
        "robot": flight.get("robot"),
        "ticks": log.ticks,
        "duration_s": log.ticks * log.timebase.period_ns / 1e9,
        "from_s": log.first_tick * log.timebase.period_ns / 1e9,
        "to_s": (log.first_tick + log.ticks) * log.timebase.period_ns / 1e9,
        "rms": rms(log),
        "maxima": maxima(log),
        "chatter": chatter(log),
    }
    unavailable: dict[str, str] = {}
    for name, figure in _FIGURES.items():
        try:
            report[name] = figure(log, period)
        except InputError as error:
            report[name], unavailable[name] = None, str(error)
    return {
        **report,
        "unavailable": unavailable,
        "lost": log.lost,
        "unanswered_ticks": log.unanswered,
        "filled_ticks": log.filled,
        "unfinished": log.unfinished,
        "damage": list(log.damage),
    }


def _without_gaps(log: FlightLog) -> FlightLog:
    found = log.longest_stretch()
    if not found.ticks:
        raise InputError("no tick has both a state and a reference")
    if found.ticks < log.ticks:
        start, stop = found.time[0], found.time[-1]
        said = f"analysed from t = {start:.4f} to {stop:.4f} s, the longest stretch without a gap"
        found.damage += (said,)
    return found


def _settling(log: FlightLog, period: float) -> dict[str, Any]:
    start = last_waypoint(log)
    if start is None:
        raise NotDescribedError("the arm does not come to rest with flight left after it")
    error = tracking_error(log)
    return {
        "band": BAND,
        "after_s": (log.first_tick + start) * period,
        "settled_s": {
            name: settling_time(error[:, axes], start, period)
            for name, axes in error_columns(log.axes).items()
        },
    }


def _saturation(log: FlightLog, period: float) -> dict[str, Any]:
    limits = torque_limits(log)
    ticks = saturated_ticks(log, limits)
    return {
        "base_torque_limit_n_m": limits.base if np.isfinite(limits.base) else None,
        "joint_torque_limit_n_m": limits.joint if np.isfinite(limits.joint) else None,
        "ticks": ticks,
        "share": ticks / log.ticks,
    }


def _latency(log: FlightLog, period: float) -> dict[str, float]:
    found = None if log.latency_s is None else latency(log.latency_s, period)
    if found is None:
        raise NotDescribedError("no wall-clock times of states and commands: not flown as a graph")
    return found


def _misses(log: FlightLog, period: float) -> dict[str, int]:
    try:
        limits = torque_limits(log)
    except InputError:
        limits = TorqueLimits(np.inf, np.inf)
    found = differing_commands(log, int(log.flight.get("command_latency_ticks", 0)), limits)
    if found is None:
        raise NotDescribedError("the commands were not recorded")
    return {
        "unanswered_ticks": log.unanswered,
        "compared_ticks": found[1],
        "differing_ticks": found[0],
    }


def _estimate_error(log: FlightLog, period: float) -> dict[str, dict[str, float]]:
    h_bar, smoothing = estimator(log)
    error = estimate_error(log, h_bar, smoothing)
    if not len(error):
        raise NotDescribedError("three measured states in a row are needed")
    each, largest = axis_rms(error), np.max(np.abs(error), axis=0)
    groups = axis_groups(log.axes - 3)
    return {
        "rms": {name: float(np.mean(each[axes])) for name, axes in groups.items()},
        "max": {name: float(np.max(largest[axes])) for name, axes in groups.items()},
    }


def _pointing(log: FlightLog, period: float) -> dict[str, dict[str, float]]:
    return summary(pointing_error(log, robot_of(log)))


def summary(error: PointingError) -> dict[str, dict[str, float]]:
    """RMS, maximum and last value of each figure of a pointing error."""
    names = ("boresight_rad", "rotation_rad", "tool_position_m", "base_drift_m")
    return {
        name: {
            "rms": float(np.sqrt(np.mean(values**2))),
            "max": float(np.max(values)),
            "end": float(values[-1]),
        }
        for name, values in zip(names, error, strict=True)
    }


_FIGURES: dict[str, Callable[[FlightLog, float], dict[str, Any]]] = {
    "settling": _settling,
    "saturation": _saturation,
    "latency": _latency,
    "misses": _misses,
    "estimate_error": _estimate_error,
    "pointing": _pointing,
}
