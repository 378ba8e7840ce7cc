"""What a page shows of a flight: the poses of all bodies at so many times a second."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_sim.robot import Robot
from space_robot_sim.robot.tool import tool_pose
from space_robot_sim.robot.transforms import Transform, joint_transforms

from ..analysis.plot_series import tick_times

Array = NDArray[np.float64]

RATE_HZ = 30.0
"""Of a flight that is not long."""
MOST_FRAMES = 1500
"""Of a flight, so that its page stays below 3 MB."""


@dataclass(frozen=True)
class Frames:
    """The motion of a robot at K ticks of its flight."""

    time: Array
    """(K,) s."""
    rows: NDArray[np.intp]
    """(K,) of the log."""
    base_position: Array
    """(K, 3) m, inertial frame."""
    base_quaternion: Array
    """(K, 4) ``[w, x, y, z]``."""
    joints: list[Transform]
    """Of every joint, a parent's before its children's."""
    tool: Array
    """(K, 3) m, the tool's place, inertial frame."""

    @classmethod
    def of(cls, log: FlightLog, robot: Robot) -> Frames:
        """Take them from a flight.

        Args:
            log: the flight, as it truly was.
            robot: that flew.
        """
        rows = shown_rows(log)
        angles = np.hstack([log.joint_positions, log.passive_positions])[rows]
        position, quaternion = log.base_position[rows], log.quaternion[rows]
        return cls(
            tick_times(log)[rows], rows, position, quaternion, joint_transforms(robot, angles),
            position + tool_pose(robot, quaternion, angles)[1],
        )  # fmt: skip


def shown_rows(log: FlightLog) -> NDArray[np.intp]:
    """Return the rows of a log that are shown, evenly spaced, the last one among them."""
    length = log.ticks * log.timebase.period
    count = int(min(MOST_FRAMES, max(2.0, RATE_HZ * length), log.ticks))
    return np.unique(np.linspace(0, log.ticks - 1, count).round().astype(np.intp))
