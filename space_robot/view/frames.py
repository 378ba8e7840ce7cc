"""The motion of a robot as its page shows it: the poses of all bodies, so many times a second."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_model.robot.tool import tool_pose
from space_robot_model.robot.transforms import Transform, joint_transforms
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..analysis.attitude_drift import controls_base
from ..analysis.plot_series import tick_times

Array = NDArray[np.float64]

RATE_HZ = 30.0
"""Of a page nobody asked another one of."""
MOST_FRAMES = 3000
"""Of a page, shared by its flights, so that it stays below 3 MB."""
STEP = 2.0**-30
"""What poses are rounded to, m: a billionth, far below what can be seen, and half the page."""


@dataclass(frozen=True)
class Frames:
    """The motion of a robot at K times."""

    time: Array
    """(K,) s."""
    base_position: Array
    """(K, 3) m, inertial frame."""
    base_quaternion: Array
    """(K, 4) ``[w, x, y, z]``."""
    joint_positions: Array
    """(K, N) of all joints, rad, or m of prismatic ones."""
    joints: list[Transform]
    """Of every joint, a parent's before its children's."""
    tools: dict[str, Array]
    """(K, 3) m, place of each tool, inertial frame."""
    desired: Array | None
    """(K, 3) m, where the first tool was wanted, the base at its true place; None: not known."""

    @classmethod
    def of(cls, log: FlightLog, robot: Robot, times: Array) -> Frames:
        """Take them from a flight; between ticks the last one holds, as after the flight's end.

        Args:
            log: the flight, as it truly was.
            robot: that flew.
            times: (K,) s.

        Raises:
            InputError: no tick of the flight has a whole state.
        """
        known = np.flatnonzero(
            log.finite(("base_position", "quaternion", "joint_positions", "passive_positions"))
        )
        if not len(known):
            raise InputError("no tick of the bag has the whole state of the robot: nothing to show")
        # a time is a tick's to half a tick: times are counted from ticks with rounding
        due = times + 0.5 * log.timebase.period
        at = np.searchsorted(tick_times(log)[known], due, side="right") - 1
        rows = known[np.maximum(at, 0)]
        position, quaternion = log.base_position[rows], _unit(log.quaternion[rows])
        angles = log.all_positions[rows]
        tools = {
            tool.name: position + tool_pose(replace(robot, tools=(tool,)), quaternion, angles)[1]
            for tool in robot.tools
        }
        joints = [
            t._replace(position=_rounded(t.position), quaternion=_rounded(t.quaternion))
            for t in joint_transforms(robot, angles)
        ]
        return cls(
            times,
            _rounded(position),
            _rounded(quaternion),
            angles,
            joints,
            tools,
            _desired(log, robot, rows),
        )

    def move_to(self, k: int) -> tuple[Array, Array, list[Transform], int]:
        """Return what `RobotScene.move` takes at the k-th time."""
        return self.base_position[k], self.base_quaternion[k], self.joints, k


def shown_times(logs: Sequence[FlightLog], rate: float) -> Array:
    """Return the times, s, that are shown of some flights: at ticks of the first one.

    Args:
        logs: of the flights, none of them empty.
        rate: so many a second, or fewer where that were too many.
    """
    start = min(float(tick_times(log)[0]) for log in logs)
    end = max(float(tick_times(log)[-1]) for log in logs)
    period = logs[0].timebase.period
    ticks = max(1, round((end - start) / period))
    frames = min((end - start) * rate, MOST_FRAMES / len(logs), ticks)
    every = np.unique(np.linspace(0, ticks, max(2, round(frames) + 1)).round())
    times: Array = start + every * period
    return times


def _desired(log: FlightLog, robot: Robot, rows: NDArray[np.intp]) -> Array | None:
    """Return the first tool's places by the reference; joints without motors rest."""
    if not controls_base(log):
        return None
    reference, joints = log.reference_base[rows, :4], log.reference_joints[rows, 0]
    rest = np.broadcast_to(
        [spring.rest for spring in robot.springs], (len(rows), len(robot.springs))
    )
    if not (np.isfinite(reference).all() and np.isfinite(joints).all()):
        return None
    return (
        log.base_position[rows] + tool_pose(robot, _unit(reference), np.hstack([joints, rest]))[1]
    )


def _rounded(values: Array) -> Array:
    return np.round(values / STEP) * STEP


def _unit(quaternion: Array) -> Array:
    unit: Array = quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)
    return unit
