"""What a motion asks of joints and base, without flying it, and its shortest duration.

A segment is a path with a quintic course in time, and the robot has no momentum and no weight: with
twice the duration its velocities and momenta are half, its accelerations and torques a quarter. So
one sample of it tells the duration at which each limit is reached.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import norms
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import inverse_dynamics
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.placements import base_axes, to_base
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import ReferenceChunk

from .courses import Course, sample_times
from .limits import LONGEST_S, MissionLimits

Array = NDArray[np.float64]

LEAST_S = 0.1
"""Duration of a fast segment in which nothing moves, s."""


class MotionDemand(NamedTuple):
    """A desired motion, and what it asks for with zero momentum at the start."""

    time: Array
    """(K,) s."""
    joints: Array
    """(K, 3, n) positions, velocities and accelerations, rad or m."""
    base: Array
    """(K, 10) quaternion, angular velocity and acceleration, base frame."""
    torque: Array
    """(K, n+3) N m on the base's axes, then N m or N of the joints; without friction."""
    momentum: Array
    """(K, 3) N m s, angular momentum that the base's actuators take up, inertial axes."""

    @property
    def base_torque(self) -> Array:
        """(K,) N m, the largest component on the base's axes."""
        largest: Array = np.max(np.abs(self.torque[:, :3]), axis=1)
        return largest

    @property
    def stored_momentum(self) -> Array:
        """(K,) N m s, length of the momentum."""
        return norms(self.momentum)

    @property
    def base_momentum(self) -> Array:
        """(K, 3) N m s, the momentum on the base's axes."""
        axes = base_axes(self.base[:, :4].T)
        return to_base(np.array(axes), self.momentum.T).T


def demand(
    robot: Robot, joints: Course, base: Course, begin: float, end: float, samples: int = 0
) -> MotionDemand:
    """Sample a motion and compute what it asks of a robot whose joints are all actuated.

    Without a number of samples they are at `sample_times`.
    """
    time = np.linspace(begin, end, samples) if samples else sample_times(begin, end)
    chunk = ReferenceChunk(0, joints.at(time), base.at(time))
    torque = inverse_dynamics(robot, chunk.references())
    motion = Motion(chunk.base[:, :4], chunk.base[:, 4:7], chunk.joints[:, 0], chunk.joints[:, 1])
    return MotionDemand(
        time, chunk.joints, chunk.base, torque, robot_momentum(robot, motion).angular
    )


def shortest_duration(
    robot: Robot, limits: MissionLimits, joints: Course, base: Course, begin: float, span: float
) -> float:
    """Return the duration at which a segment comes to the first of its limits, s.

    Args:
        robot: whose joints are all actuated.
        limits: beside those of the robot's joints.
        joints: course in ``span``.
        base: course in ``span``.
        begin: s.
        span: s, any duration.
    """
    shares = list(_shares(robot, limits, joints, base, begin, span))
    if not shares:
        raise InputError(
            "fast: no limit of velocity, acceleration, torque or momentum is known: give a "
            "duration, or limits (base_torque, base_momentum, base_rate_deg, "
            "joint_acceleration_deg)"
        )
    longer, limit = max(shares)
    if not span * longer <= LONGEST_S:  # true of NaN
        raise InputError(
            f"fast: it takes {span * longer:.3g} s to keep to {limit}, at most {LONGEST_S:g} s "
            "(11 days) are flown"
        )
    return max(LEAST_S, span * longer)


def _shares(
    robot: Robot, limits: MissionLimits, joints: Course, base: Course, begin: float, span: float
) -> Iterator[tuple[float, str]]:
    # k times the duration: 1/k of rates and momenta, 1/k^2 of accelerations and torques
    asked = demand(robot, joints, base, begin, begin + span)
    rates = np.max(np.abs(asked.joints[:, 1]), axis=0)
    accelerations = np.max(np.abs(asked.joints[:, 2]), axis=0)
    efforts = np.max(np.abs(asked.torque[:, 3:]), axis=0)
    names = robot.joint_names
    per_unit = np.where(robot.is_prismatic[: robot.n], 1.0, np.pi / 180.0)
    for joint, limit in enumerate(robot.limits):
        if math.isfinite(limit.velocity):
            yield float(rates[joint] / limit.velocity), f"the velocity of joint {names[joint]!r}"
        if math.isfinite(limit.effort):
            yield (
                math.sqrt(float(efforts[joint] / limit.effort)),
                f"the effort of joint {names[joint]!r}",
            )
        if limits.joint_acceleration_deg:
            bound = limits.joint_acceleration_deg * float(per_unit[joint])
            yield math.sqrt(float(accelerations[joint] / bound)), "joint_acceleration_deg"
    if limits.base_torque:
        yield math.sqrt(float(np.max(asked.base_torque) / limits.base_torque)), "base_torque"
    if limits.base_momentum:
        yield float(np.max(asked.stored_momentum) / limits.base_momentum), "base_momentum"
    if limits.base_rate_deg:
        bound = math.radians(limits.base_rate_deg)
        yield float(np.max(norms(asked.base[:, 4:7])) / bound), "base_rate_deg"
