"""What a mission may ask for: limits of joints and base, and checks of planned motions.

Numbers of any size may come from files, parameters and messages. Whatever was planned from them is
checked here, before it becomes a reference.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_model.elementary.matrices import norms
from space_robot_model.robot import Robot
from space_robot_model.robot.parts import MANY_TURNS, JointLimits
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError

from .courses import Piece, sample_times

Array = NDArray[np.float64]

ROUNDING = 1e-9
"""rad or m, by which a posture may be beyond a limit: both were written in degrees, maybe."""
HALFWAY = 15.0 / 8.0
"""Largest velocity of a quintic leg from rest to rest, as a share of its mean velocity."""
SHORTEST_S, LONGEST_S = 1e-6, 1e6
"""Duration of a segment, s; the longest is eleven days."""
FARTHEST = 1e4
"""Largest position of a joint, rad or m."""
FASTEST, SHARPEST = 100.0, 1e4
"""Largest rate and acceleration of joints and base, rad/s or m/s, and per s; more is a jump."""
BETWEEN_KNOTS = 3
"""Times between two knots of a spline at which it is checked."""
AT_ONCE = 10_000
"""Times that are checked together, so that the memory for them stays small."""


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
        True,
        description="refuse segments that ask the base's actuators for more than they give; else "
        "flights warn of them",
    )


def shown_unit(robot: Robot, joint: int) -> tuple[float, str]:
    """Return how many of the unit that a joint is written in make 1 rad or m, and that unit."""
    return (1.0, "m") if robot.is_prismatic[joint] else (180.0 / np.pi, "degrees")


@np.errstate(all="ignore")  # numbers that overflow are refused here, in one line
def check_piece(robot: Robot, piece: Piece) -> None:
    """Check a segment: finite, neither too long nor too sudden, within the limits of the joints.

    Raises:
        InputError: it is not; names joint, time, value and limit.
    """
    span = piece.end - piece.begin
    if not SHORTEST_S <= span <= LONGEST_S:
        raise InputError(
            f"a duration of {SHORTEST_S:g} to {LONGEST_S:g} s (11 days) was expected, "
            f"got {span:g} s"
        )
    for time in _times(piece):
        joints, base = piece.joints.at(time), piece.base.at(time)
        _check_motion(robot, time, joints, base)
        for joint, limits in enumerate(robot.limits):
            _check_limits(robot, joint, limits, time, joints[:, :, joint])


def _times(piece: Piece) -> Iterator[Array]:
    times = [sample_times(piece.begin, piece.end)]
    for course in (piece.joints, piece.base):
        # by name: splines are slow to import, and a mission of waypoints needs none
        if spline := getattr(course, "spline", None):
            knots = piece.begin + spline.times
            shares = np.linspace(0.0, 1.0, BETWEEN_KNOTS + 2)[:-1]
            times.append((knots[:-1, np.newaxis] + np.diff(knots)[:, np.newaxis] * shares).ravel())
    together = np.unique(np.concatenate(times)) if len(times) > 1 else times[0]
    yield from np.array_split(together, -(-len(together) // AT_ONCE))


def _check_motion(robot: Robot, time: Array, joints: Array, base: Array) -> None:
    for order, (word, most, per) in enumerate(
        (
            ("comes to", FARTHEST, ""),
            ("moves at", FASTEST, "/s"),
            ("accelerates by", SHARPEST, "/s2"),
        )
    ):
        values = np.abs(joints[:, order])
        if not np.all(values <= most):  # true of NaN
            k, joint = divmod(int(np.argmin(values <= most)), values.shape[1])
            scale, unit = shown_unit(robot, joint)
            raise InputError(
                f"joint {robot.joint_names[joint]!r} {word} {joints[k, order, joint] * scale:.4g} "
                f"{unit}{per} at t = {time[k]:.6g} s, at most {most * scale:.4g} can be flown"
            )
    for part, (word, most, unit) in zip(
        (base[:, 4:7], base[:, 7:]),
        (("turns at", FASTEST, "rad/s"), ("accelerates by", SHARPEST, "rad/s2")),
        strict=True,
    ):
        lengths = norms(part)
        if not np.all(lengths <= most):
            k = int(np.argmin(lengths <= most))
            raise InputError(
                f"the base {word} {lengths[k]:.4g} {unit} at t = {time[k]:.6g} s, at most {most:g} "
                "can be flown"
            )
    if not np.all(np.isfinite(base[:, :4])):
        raise InputError("the base's attitude is not finite")


def _check_limits(
    robot: Robot, joint: int, limits: JointLimits, time: Array, motion: Array
) -> None:
    name, position, rate = robot.joint_names[joint], motion[:, 0], motion[:, 1]
    beyond = np.maximum(limits.lower - position, position - limits.upper)
    if beyond.max() > ROUNDING:
        k = int(np.argmax(beyond > ROUNDING))
        far, (scale, unit) = int(np.argmax(beyond)), shown_unit(robot, joint)
        raise InputError(
            f"joint {name!r} leaves its limits at t = {time[k]:.2f} s and comes to "
            f"{position[far] * scale:.6g} {unit}, they are {limits.lower * scale:.6g} to "
            f"{limits.upper * scale:.6g} {unit}"
        )
    fastest = int(np.argmax(np.abs(rate)))
    if abs(rate[fastest]) > limits.velocity * (1.0 + ROUNDING):
        scale, unit = shown_unit(robot, joint)
        raise InputError(
            f"joint {name!r} moves at {abs(rate[fastest]) * scale:.4g} {unit}/s at "
            f"t = {time[fastest]:.2f} s, its limit is {limits.velocity * scale:.4g} {unit}/s: "
            "a longer duration is needed"
        )


def check_start(robot: Robot, joints: Array) -> None:
    """Check that the joints (n,), rad or m, of a start are within their limits."""
    for joint, (name, limits) in enumerate(zip(robot.joint_names, robot.limits, strict=True)):
        low, high, position = limits.lower, limits.upper, float(joints[joint])
        if not low - ROUNDING <= position <= high + ROUNDING:
            scale, unit = shown_unit(robot, joint)
            raise InputError(
                f"the start has joint {name!r} at {position * scale:.6g} {unit}, its limits are "
                f"{low * scale:.6g} to {high * scale:.6g} {unit}"
            )


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
