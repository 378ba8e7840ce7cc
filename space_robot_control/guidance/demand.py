"""What a motion asks of joints and base: rates, torques and momentum, without flying it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import norms
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import inverse_dynamics
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.placements import base_axes, to_base
from space_robot_msgs_py.samples import ReferenceChunk

from .courses import Course, sample_times

Array = NDArray[np.float64]


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

    Args:
        robot: the robot.
        joints: of the motion.
        base: of the motion.
        begin: s.
        end: s.
        samples: number of samples; 0: see `sample_times`.
    """
    time = np.linspace(begin, end, samples) if samples else sample_times(begin, end)
    chunk = ReferenceChunk(0, joints.at(time), base.at(time))
    torque = inverse_dynamics(robot, chunk.references())
    motion = Motion(chunk.base[:, :4], chunk.base[:, 4:7], chunk.joints[:, 0], chunk.joints[:, 1])
    return MotionDemand(
        time, chunk.joints, chunk.base, torque, robot_momentum(robot, motion).angular
    )
