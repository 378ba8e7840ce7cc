"""Check of a planned segment against the limits of the robot's joints and against singularities."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError

from .courses import Piece, sample_times
from .limits import ROUNDING, shown_unit

Array = NDArray[np.float64]


def check_piece(robot: Robot, piece: Piece) -> None:
    """Check positions and velocities of all joints along a segment.

    Raises:
        InputError: naming joint, time, value and limit.
    """
    time = sample_times(piece.begin, piece.end)
    rows = piece.joints.at(time)
    for joint, (name, limits) in enumerate(zip(robot.joint_names, robot.limits, strict=True)):
        scale, unit = shown_unit(robot, joint)
        position, rate = rows[:, 0, joint], rows[:, 1, joint]
        beyond = np.maximum(limits.lower - position, position - limits.upper)
        if beyond.max() > ROUNDING:
            k = int(np.argmax(beyond > ROUNDING))
            far = int(np.argmax(beyond))
            raise InputError(
                f"joint {name!r} leaves its limits at t = {time[k]:.2f} s and comes to "
                f"{position[far] * scale:.6g} {unit}, they are {limits.lower * scale:.6g} to "
                f"{limits.upper * scale:.6g} {unit}"
            )
        fastest = int(np.argmax(np.abs(rate)))
        if abs(rate[fastest]) > limits.velocity * (1.0 + ROUNDING):
            raise InputError(
                f"joint {name!r} moves at {abs(rate[fastest]) * scale:.4g} {unit}/s at "
                f"t = {time[fastest]:.2f} s, its limit is {limits.velocity * scale:.4g} {unit}/s: "
                "a longer duration is needed"
            )
