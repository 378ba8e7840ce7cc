"""Numbers of flights that the pages on actuators of the base show."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from space_robot.analysis import analyze
from space_robot.analysis.analysed_log import AnalysedLog
from space_robot.analysis.described import flown_robot
from space_robot.analysis.errors import tracking_error
from space_robot.analysis.measure import evaluate
from space_robot.analysis.sizing import ActuatorSet
from space_robot.analysis.words import with_statistic
from space_robot.api.flown_flight import FlownFlight
from space_robot_control.allocation.settings import assumed_actuators

ATTITUDE = "attitude.rms"
JOINTS_1_3 = "joints_1_3.rms"
LAWS = ("ctc", "ctc_smc", "tde_smc", "tde_tsmc", "tde_stc")
DRIFT, DEGREES = "attitude_drift.end", 180.0 / np.pi
PEAKS = tuple(f"sizing.base_{axis}.peak_torque" for axis in "xyz")


def largest_wheel_torque(flown: FlownFlight) -> float:
    """Return the largest torque that a wheel's motor gave, N m."""
    return float(np.max(np.abs(flown.log.wheel_torques)))


def impulse(flown: FlownFlight) -> float:
    """Return the sum of all thrusters' impulses, N s."""
    return float(np.sum(flown.log.thrusts)) * flown.log.timebase.period


def pulses(flown: FlownFlight) -> float:
    """Return how often a valve opened."""
    is_open = np.pad(flown.log.thrusts > 0.0, ((1, 0), (0, 0)))
    return float(np.count_nonzero(is_open[1:] & ~is_open[:-1]))


def ended_at(flown: FlownFlight) -> float:
    """Return the time of the flight's end, s."""
    return flown.ended_at_s


def largest_attitude_error(flown: FlownFlight) -> float:
    """Return the largest error of an axis of the vector part from 10 s on."""
    return float(np.max(np.abs(tracking_error(flown.log)[flown.log.time >= 10.0, :3])))


def attitude_error_at(time: float) -> Callable[[FlownFlight], float]:
    """Return the largest error of an axis of the quaternion's vector part at a time, s."""

    def error(flown: FlownFlight) -> float:
        row = min(round(time / flown.log.timebase.period), flown.log.ticks - 1)
        return float(np.max(np.abs(tracking_error(flown.log)[row, :3])))

    error.__name__ = f"attitude_error_at_{time:g}_s"
    return error


def first_at_limit(flown: FlownFlight) -> float:
    """Return the time at which a wheel was first at a limit, s."""
    numbers, _ = evaluate(AnalysedLog(flown.log), groups=("wheel_saturation",))
    return min(with_statistic(numbers, "first_limit").values())


def largest_base_torque(flown: FlownFlight) -> float:
    """Return the largest torque on an axis of the base, N m."""
    return float(np.max(np.abs(flown.log.applied_torque[:, :3])))


def asked_of_a_wheel(quantity: str) -> Callable[[FlownFlight], float]:
    """Return the most that the flight asks of one of the wheels of `wheels`."""

    def asked(flown: FlownFlight) -> float:
        wheels = ActuatorSet("wheels", assumed_actuators("wheels", flown_robot(flown.log)))
        requirements = analyze(flown.log, wheels)["sizing"]["requirements"]
        of_wheels = [r for r in requirements if r["part"].startswith("wheel_")]
        return float(max(r["asked"] for r in of_wheels if r["quantity"] == quantity))

    asked.__name__ = f"{quantity.replace(' ', '_')}_of_a_wheel"
    return asked
