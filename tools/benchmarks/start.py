"""Where the plant and its peers start, and the length of their steps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from kernels import Array
from scipy.spatial.transform import Rotation

from space_robot_model.robot import Robot

PERIOD = 5e-4
"""s."""


@dataclass(frozen=True)
class Start:
    """Where a robot starts, and the torque held from then on: base (base frame), joints; N m."""

    robot: Robot
    quaternion: Array
    theta: Array
    v0: Array
    w0: Array
    rate: Array
    torque: Array

    @classmethod
    def moving(cls, robot: Robot, rate: float = 0.1, torque: float = 0.0) -> Start:
        """Return one in which everything turns."""
        n = robot.n
        rng = np.random.default_rng(n)
        theta = rng.uniform(-1.0, 1.0, n)
        v0, w0, rates = (rng.uniform(-rate, rate, size) for size in (3, 3, n))
        force = torque * rng.uniform(-1.0, 1.0, n + 3)
        return cls(robot, np.array([0.8, 0.36, -0.48, 0.0]), theta, v0, w0, rates, force)

    @property
    def rotation(self) -> Rotation:
        """Attitude of the base."""
        return rotation_of(self.quaternion)

    @property
    def x(self) -> Array:
        """The plant's state."""
        parts = (np.zeros(3), self.quaternion, self.theta, self.v0, self.w0, self.rate)
        return np.concatenate(parts)


def rotation_of(quaternion: Array) -> Rotation:
    """Return SciPy's rotation of ``[w, x, y, z]``."""
    return Rotation.from_quat(np.roll(quaternion, -1))
