"""The motion of a robot, sampled for a page: poses of all bodies."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import Array, unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.placements import Transform, joint_transforms, tool_pose
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..analysis.errors import controls_base

RowIndices = NDArray[np.intp]
Move = Callable[[int], None]
"""Updates a part of a scene to the k-th frame; called for k = 0, 1, ..."""

RATE_HZ = 30.0
"""Default frame rate of a page."""
MOST_FRAMES = 3000
"""Maximum number of frames of all flights of a page, to keep it below 3 MB."""
STEP = 2.0**-30
"""Resolution of poses, m: invisible, and halves the size of the page."""
STATE = ("base_position", "quaternion", "joint_positions", "passive_positions")
"""Columns of a flight that are needed for a pose."""


@dataclass(frozen=True)
class Frames:
    """The motion of a robot at K times, inertial frame."""

    time: Array
    """(K,) time, s."""
    base_position: Array
    """(K, 3) m."""
    base_quaternion: Array
    """(K, 4) ``[w, x, y, z]``."""
    joint_positions: Array
    """(K, N) positions of all joints, rad, or m for prismatic ones."""
    joints: list[Transform]
    """Transforms of all joints, parents before children."""
    tools: dict[str, Array]
    """(K, 3) position of each tool, m."""
    desired: Array | None
    """(K, 3) desired position of the first tool, m; or None. For a mission of waypoints it is
    that for the true base position."""

    @classmethod
    def of(cls, log: FlightLog, robot: Robot, times: Array, wanted: Array | None = None) -> Frames:
        """Sample a flight at ``times`` (K,), s; between ticks the last state is held.

        ``wanted`` (N, 3), m, are the positions to which a mission leads the first tool.

        Raises:
            InputError: no tick of the flight has a complete state.
        """
        rows = held_rows(log, STATE, times)
        if not len(rows):
            raise InputError("no tick of the bag has the complete state of the robot")
        position, quaternion = log.base_position[rows], unit_rows(log.quaternion[rows])
        angles = log.all_positions[rows]
        tools = {
            tool.name: position + tool_pose(replace(robot, tools=(tool,)), quaternion, angles)[1]
            for tool in robot.tools
        }
        joints = [
            t._replace(position=rounded(t.position), quaternion=rounded(t.quaternion))
            for t in joint_transforms(robot, angles)
        ]
        desired = _desired(log, robot, rows) if wanted is None else wanted[rows]
        position, quaternion = rounded(position), rounded(quaternion)
        return cls(times, position, quaternion, angles, joints, tools, desired)


def shown_times(logs: Sequence[FlightLog], rate: float) -> Array:
    """Return the times, s, of the frames of some flights, ticks of the first one.

    The ``rate``, frames per second, is reduced for long flights. No log is empty.
    """
    start = min(float(log.time[0]) for log in logs)
    end = max(float(log.time[-1]) for log in logs)
    period = logs[0].timebase.period
    ticks = max(1, round((end - start) / period))
    frames = min((end - start) * rate, MOST_FRAMES / len(logs), ticks)
    every = np.unique(np.linspace(0, ticks, max(2, round(frames) + 1)).round())
    times: Array = start + every * period
    return times


def held_rows(log: FlightLog, columns: Sequence[str], times: Array) -> RowIndices:
    """Return the rows (K,) of a flight to be shown at ``times``: the last with all ``columns``.

    Before the first complete row it is that one; (0,) if no row is complete.
    """
    known = np.flatnonzero(log.finite(columns))
    return known[frame_rows(log, times, known)] if len(known) else known


def frame_rows(log: FlightLog, times: Array, rows: RowIndices | slice = slice(None)) -> RowIndices:
    """Return the number of the last of a flight's ``rows`` at or before each time, or 0."""
    # times are rounded: the nearest tick is meant
    due = times + 0.5 * log.timebase.period
    return np.asarray(np.maximum(np.searchsorted(log.time[rows], due, side="right") - 1, 0))


def _desired(log: FlightLog, robot: Robot, rows: RowIndices) -> Array | None:
    """Return the first tool's desired positions, (K, 3) m, with passive joints at rest."""
    if not controls_base(log):
        return None
    reference, joints = log.reference_base[rows, :4], log.reference_joints[rows, 0]
    if not (np.isfinite(reference).all() and np.isfinite(joints).all()):
        return None
    rest = np.tile([spring.rest for spring in robot.springs], (len(rows), 1))
    _, offset = tool_pose(robot, unit_rows(reference), np.hstack([joints, rest]))
    return log.base_position[rows] + offset


def rounded(values: Array) -> Array:
    """Return values rounded to `STEP`."""
    return np.round(values / STEP) * STEP
