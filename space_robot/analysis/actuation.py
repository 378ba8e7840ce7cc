"""Metrics of the commands: limits reached, latency, deadlines missed."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog, Metric, last_rows
from space_robot_msgs_py.errors import InputError

from .generalised_motion import measured_rows

Array = NDArray[np.float64]

STANDING = 0.01
"""Share of the desired velocity below which a joint stands."""
ROUNDING = 1e-9
"""rad or m of a position, share of the limit of velocity and effort, that is not beyond it."""
LEAST_WAY = 1e-3
"""Way, rad or m, from which on it is of interest whether a joint stands."""

PERCENTILES = {"p50": 50.0, "p99": 99.0, "max": 100.0}


class TorqueLimits(NamedTuple):
    """Largest torque of each actuator of base and joints, N m; infinite where there is no limit."""

    base: float
    joint: float

    def of_axes(self, axes: int) -> Array:
        """Return the limit of each axis, (m,) N m."""
        return np.array([self.base] * 3 + [self.joint] * (axes - 3))


class Saturation(Metric):
    """Number of ticks at which the torque applied on some axis was at its limit.

    The plant clips to the limit, so "at" is exact but for the rounding of whoever recorded. It is
    the torque as reported, behind the limits and before what the drives make of it.
    """

    def __init__(self, limits: TorqueLimits) -> None:
        self._limits = limits
        self._ticks = self._rows = 0

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        limit = self._limits.of_axes(log.axes) * (1.0 - 1e-9)
        at_limit = np.abs(log.as_measured().applied_torque) >= limit
        self._ticks += int(np.count_nonzero(at_limit.any(axis=1)))
        self._rows += log.ticks

    def result(self) -> dict[str, Any]:
        """Return the limits (None: none), the ticks at one, and their share of all ticks."""
        base, joint = self._limits
        return {
            "base_torque_limit_n_m": base if np.isfinite(base) else None,
            "joint_torque_limit_n_m": joint if np.isfinite(joint) else None,
            "ticks": self._ticks,
            "share": self._ticks / self._rows,
        }


class Latency(Metric):
    """Percentiles of the wall-clock time from sending a state to sending its command."""

    def __init__(self, period: float) -> None:
        """Begin without rows; ``period`` is that of a tick, s."""
        self._period = period
        self._known: list[Array] = []

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows; where a graph was flown, 8 bytes a tick are kept."""
        if log.latency_s is not None:
            self._known.append(log.latency_s[np.isfinite(log.latency_s)])

    def result(self) -> dict[str, float]:
        """Return ``p50``, ``p99``, ``max`` as ``..._ms`` and ``..._ticks``, and ``answers``."""
        known = np.concatenate([np.empty(0), *self._known])
        if not len(known):
            raise InputError("no wall-clock times of states and commands: not flown as a graph")
        percentiles = np.percentile(known, list(PERCENTILES.values()))
        values = dict(zip(PERCENTILES, percentiles, strict=True))
        return {
            **{f"{name}_ms": float(1e3 * value) for name, value in values.items()},
            **{f"{name}_ticks": float(value / self._period) for name, value in values.items()},
            "answers": len(known),
        }


class MissedDeadlines(Metric):
    """Number of ticks without their own command, or with a late one.

    The plant's diagnostics count them all as they happen (``missed_deadlines``); a recording tells
    two kinds apart: ticks that no command was ever recorded for (``unanswered_ticks``), and ticks
    with a command other than the torque that was applied (``differing_ticks``), since it was late.

    The torque applied over the interval that begins at tick k is reported with the state of tick
    k+1; commanded for it was the answer to tick ``k - latency_ticks``, clipped to the limits. In
    lockstep they are the same to the last bit. By the wall clock the plant holds the command
    before where an answer is late.

    Hardware on the base gives what it can of a torque, and a free base has none: the joints
    alone then tell whether a command was in time, for it is applied as a whole.
    """

    def __init__(
        self, latency_ticks: int, limits: TorqueLimits, base_is_ideal: bool = True
    ) -> None:
        self._delay, self._limits = latency_ticks + 1, limits
        self._axes = slice(0 if base_is_ideal else 3, None)
        self._before: FlightLog | None = None
        """The last row."""
        self._due: Array | None = None
        """(K, m) commands of the last rows, K up to the delay."""
        self._known = self._unanswered = 0
        self.differing = self.compared = 0
        """Ticks that differ, and those that were compared: they have a command."""

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows.

        Drives give another torque than commanded, an echo tells another one, and in time: what
        counts is that neither is as commanded.
        """
        reported = log.as_measured()
        measured = measured_rows(reported, self._before)
        self._before, self._unanswered = last_rows(reported, 1), log.unanswered
        if log.commanded_torque is None:
            return
        self._known += int(np.count_nonzero(np.isfinite(log.commanded_torque[:, 0])))
        commands = log.commanded_torque
        if self._due is not None:
            commands = np.concatenate([self._due, commands])
        # the first row that applies one of them is ``delay`` rows behind the first of them
        first = min(log.ticks, max(0, log.ticks + self._delay - len(commands)))
        limit = self._limits.of_axes(log.axes)
        commanded = np.clip(commands[: log.ticks - first], -limit, limit)
        known = np.isfinite(commanded).all(axis=1) & measured[first:]
        differ = self._differ(reported, first, commanded) & known
        if reported is not log:
            differ &= self._differ(log, first, commanded)
        self.differing += int(np.count_nonzero(differ))
        self.compared += int(np.count_nonzero(known))
        self._due = commands[-self._delay :].copy()

    def _differ(self, log: FlightLog, first: int, commanded: Array) -> NDArray[np.bool_]:
        """(N - first,) true where another torque was applied than ``commanded``."""
        axes = self._axes
        differ: NDArray[np.bool_] = np.any(
            log.applied_torque[first:, axes] != commanded[:, axes], axis=1
        )
        return differ

    def result(self) -> dict[str, int]:
        """Return the unanswered, compared and differing ticks."""
        if not self._known:
            raise InputError("the commands were not recorded")
        return {
            "unanswered_ticks": self._unanswered,
            "compared_ticks": self.compared,
            "differing_ticks": self.differing,
        }


class BeyondLimits(Metric):
    """Number of ticks at which each joint was beyond the limits of the robot's file.

    The plant has no end stops, and does not limit velocity and effort by that file.
    """

    def __init__(self, log: FlightLog, robot: Robot) -> None:
        """``log``: the first rows; ``robot`` that was flown."""
        joints = log.reference_joints.shape[2]
        self._names = log.joint_names[:joints]
        self._limits: Array = np.array(robot.limits[:joints]).reshape(joints, 4).T
        self._ticks = np.zeros((3, joints), dtype=np.intp)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        lower, upper, velocity, effort = self._limits
        joints = len(self._names)
        position = log.joint_positions[:, :joints]
        beyond = (
            np.maximum(position - upper, lower - position) > ROUNDING,
            np.abs(log.joint_velocities[:, :joints]) > velocity * (1.0 + ROUNDING),
            np.abs(log.applied_torque[:, 3:]) > effort * (1.0 + ROUNDING),
        )
        self._ticks += np.count_nonzero(beyond, axis=1)

    def result(self) -> dict[str, dict[str, int]]:
        """Return the ticks beyond position, velocity and effort, by joint that has a limit."""
        return {
            name: dict(zip(("position", "velocity", "effort"), map(int, ticks), strict=True))
            for name, ticks, limits in zip(self._names, self._ticks.T, self._limits.T, strict=True)
            if np.isfinite(limits).any()
        }


class StandingJoints(Metric):
    """Share of the way that each joint is to move on which it stands, as friction holds it.

    A joint stands at a tick at which it is slower than `STANDING` of the desired velocity. Ticks
    count by the desired velocity, so that a joint that starts a little late counts for little.
    """

    def __init__(self, log: FlightLog) -> None:
        """``log``: the first rows."""
        self._joints, self._period = log.reference_joints.shape[2], log.timebase.period
        self._names = log.joint_names[: self._joints]
        self._way, self._standing = np.zeros((2, self._joints))

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        desired = np.abs(log.reference_joints[:, 1])
        stands = np.abs(log.joint_velocities[:, : self._joints]) < STANDING * desired
        self._way += np.sum(desired, axis=0)
        self._standing += np.sum(desired, axis=0, where=stands)

    def result(self) -> dict[str, float]:
        """Return the share by joint, of those that are to move by `LEAST_WAY` or more."""
        return {
            name: float(standing / way)
            for name, standing, way in zip(self._names, self._standing, self._way, strict=True)
            if way * self._period >= LEAST_WAY
        }
