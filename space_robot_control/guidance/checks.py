"""Check of a planned segment against the limits of the robot's joints and against singularities."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError

from .courses import Piece
from .limits import ROUNDING

Array = NDArray[np.float64]

SAMPLE_S = 0.01


def check_piece(robot: Robot, piece: Piece) -> None:
    """Check positions and velocities of all joints along a segment.

    Raises:
        InputError: naming joint, time, value and limit.
    """
    span = piece.end - piece.begin
    time = np.linspace(piece.begin, piece.end, max(101, round(span / SAMPLE_S) + 1))
    rows = piece.joints.at(time)
    for joint, (name, limits) in enumerate(zip(robot.joint_names, robot.limits, strict=True)):
        is_prismatic = bool(robot.is_prismatic[joint])
        scale, unit = (1.0, "m") if is_prismatic else (180.0 / np.pi, "degrees")
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
