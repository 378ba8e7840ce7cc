"""Motions with a base that turns freely: the attitude that the joints' motion leads to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.inverse_kinematics import FreeBase, free_attitude_into
from space_robot_model.elementary.matrices import product
from space_robot_model.elementary.rotations import quaternion_of_rotation
from space_robot_model.elementary.splines import CubicSpline
from space_robot_model.robot import Robot

from .courses import Course, quintic, turn_between
from .spline_courses import AttitudeCourse

Array = NDArray[np.float64]


def free_attitude(
    robot: Robot, joints: Course, quaternion: Array, begin: float, times: Array
) -> AttitudeCourse:
    """Return the motion of a free base during a motion of the joints from rest to rest.

    Args:
        robot: whose joints are all actuated.
        joints: the motion.
        quaternion: (4,) of the base at the begin, unit.
        begin: s, of the motion.
        times: (K,) s from there to the end, equally far apart.
    """
    row = list(robot.model_rows)
    motion = joints.at(begin + with_middles(times))
    positions, rates = np.empty((2, len(motion), len(row)))
    positions[:, row], rates[:, row] = motion[:, 0], motion[:, 1]
    attitudes = np.empty((len(times), 4))
    attitudes[0] = quaternion
    work = FreeBase.allocate(robot.joint_count)
    free_attitude_into(robot.model, positions, rates, float(times[1]), work, attitudes)
    return AttitudeCourse(begin, CubicSpline(times, attitudes))


def with_middles(times: Array) -> Array:
    """Return (2 K - 1,) times: those given (K,), and those halfway between."""
    out = np.empty(2 * len(times) - 1)
    out[::2], out[1::2] = times, 0.5 * (times[1:] + times[:-1])
    return out


def twists_along(positions: Array, rotations: Array, share: Array, span: float) -> Array:
    """Return the twists (T, 6) along a line and the shortest turn, on inertial axes.

    Args:
        positions: (T, 3) on a straight line, m.
        rotations: (T, 3, 3) on the shortest turn, or (0, 3, 3).
        share: (T,) of the time.
        span: s.
    """
    rate = quintic(share)[1][:, np.newaxis] / span
    twists = np.zeros((len(share), 6))
    twists[:, :3] = (positions[-1] - positions[0]) * rate
    if len(rotations):
        first, last = (quaternion_of_rotation(rotations[k]) for k in (0, -1))
        axis, angle = turn_between(first, last)
        twists[:, 3:] = product(rotations[0], axis) * angle * rate
    return twists
