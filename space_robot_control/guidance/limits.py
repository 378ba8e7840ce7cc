"""Check of a mission against the limits of a robot's joints.

A leg of a mission stays between its waypoints, so that positions are within the limits if those of
the waypoints are. The desired velocity is largest halfway, ``15/8`` of the mean one.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_model.robot import Robot
from space_robot_model.robot.parts import MANY_TURNS
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError

from .courses import Piece, sample_times

Array = NDArray[np.float64]

ROUNDING = 1e-9
"""rad or m, by which a waypoint may be beyond a limit: both were written in degrees, maybe."""
HALFWAY = 15.0 / 8.0
"""Largest velocity of a quintic leg from rest to rest, as a share of its mean velocity."""


Limit = Annotated[float, Field(ge=0.0, le=1e9)]


class MissionLimits(StrictModel):
    """What segments may ask for, beside the limits of the robot's joints; 0: no limit."""

    base_torque: Limit = Field(0.0, description="on each axis of the base, N m")
    base_momentum: Limit = Field(0.0, description="angular momentum taken up by the base, N m s")
    base_rate_deg: Limit = Field(0.0, description="angular velocity of the base, degrees/s")
    joint_acceleration_deg: Limit = Field(
        0.0, description="of each joint, degrees/s2, or m/s2 of prismatic joints"
    )
    check_actuators: bool = Field(
        True, description="refuse segments that ask the base's actuators for more than they give"
    )


class Beyond(NamedTuple):
    """A value of a mission beyond the limit of a joint."""

    joint: str
    asked: float
    limit: float
    unit: str


def shown_unit(robot: Robot, joint: int) -> tuple[float, str]:
    """Return how many of the unit that a joint is written in make 1 rad or m, and that unit.

    ``joint`` is counted from 0.
    """
    return (1.0, "m") if robot.is_prismatic[joint] else (180.0 / np.pi, "degrees")


def check_positions(robot: Robot, waypoints: Array) -> None:
    """Check that all ``waypoints`` (K, n), rad or m, are within the joints' limits.

    Raises:
        InputError: naming the first one beyond.
    """
    for number, waypoint in enumerate(waypoints):
        for joint, (name, limits) in enumerate(zip(robot.joint_names, robot.limits, strict=True)):
            low, high, position = limits.lower, limits.upper, float(waypoint[joint])
            if low - ROUNDING <= position <= high + ROUNDING:
                continue
            scale, unit = shown_unit(robot, joint)
            raise InputError(
                f"waypoints_deg: waypoint {number + 1} has joint {name!r} at "
                f"{position * scale:.6g} {unit}, its limits are {low * scale:.6g} to "
                f"{high * scale:.6g} {unit}"
            )


def too_fast(robot: Robot, times: Array, waypoints: Array) -> list[Beyond]:
    """Return the joints whose desired velocity is above their limit somewhere, and the largest.

    ``times`` (K,) s, and ``waypoints`` (K, n), rad or m.
    """
    if len(times) < 2:
        return []
    legs = np.abs(np.diff(waypoints, axis=0)) / np.diff(times)[:, np.newaxis]
    return [
        Beyond(name, float(fastest), limits.velocity, "m/s" if is_prismatic else "rad/s")
        for name, fastest, limits, is_prismatic in zip(
            robot.joint_names,
            HALFWAY * legs.max(axis=0),
            robot.limits,
            robot.is_prismatic[: robot.n],
            strict=True,
        )
        if fastest > limits.velocity * (1.0 + ROUNDING)
    ]


def turn_remarks(robot: Robot, pieces: Iterable[Piece]) -> list[str]:
    """Return a remark on each joint that a trajectory from a file turns so far as if in degrees."""
    far = np.zeros(robot.n)
    for piece in pieces:
        if piece.motion in ("file", "trajectory"):
            rows = piece.joints.at(sample_times(piece.begin, piece.end))
            far = np.maximum(far, np.abs(rows[:, 0]).max(axis=0))
    return [
        f"the trajectory leads joint {name!r} to {np.degrees(angle):.6g} degrees "
        f"({angle:.6g} rad): its numbers are in rad"
        for name, angle, slides in zip(robot.joint_names, far, robot.is_prismatic, strict=False)
        if angle > MANY_TURNS and not slides
    ]


def too_strong(robot: Robot, force: Array) -> list[Beyond]:
    """Return the joints whose ``force`` (K, n), N m or N, is above their limit, and the largest."""
    return [
        Beyond(name, float(largest), limits.effort, "N" if is_prismatic else "N m")
        for name, largest, limits, is_prismatic in zip(
            robot.joint_names,
            np.abs(force).max(axis=0, initial=0.0),
            robot.limits,
            robot.is_prismatic[: robot.n],
            strict=True,
        )
        if largest > limits.effort * (1.0 + ROUNDING)
    ]
