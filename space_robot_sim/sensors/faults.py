"""Noisy and coarse sensors: what the controller is told instead of the plant's true state."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.samples import RobotState

from ..dynamics.attitude import quaternion_rate
from ..faults.schedule import Schedule

Array = NDArray[np.float64]

MEASURED = {
    "attitude": "quaternion",
    "gyro": "omega_base",
    "joint_position": "joint_positions",
    "joint_velocity": "joint_velocities",
}
"""Field of `RobotState` by the name its faults have."""
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])


class SensorFaults:
    """Noise first, then quantisation, as in a sensor with a converter behind it.

    The echo of the applied torque is left alone.
    """

    def __init__(self, schedule: Schedule, n: int) -> None:
        self._noises = [
            (fault, field) for name, field in MEASURED.items()
            for fault in schedule.of(f"noise_{name}")
        ]  # fmt: skip
        self._quantisers = [
            (fault, field) for name, field in MEASURED.items()
            for fault in schedule.of(f"quantise_{name}")
        ]  # fmt: skip
        self._measured = RobotState.allocate(n)

    def measure(self, state: RobotState) -> RobotState:
        """What the sensors make of the true ``state``; the same object at every call."""
        tick, measured = state.tick, self._measured
        measured.tick = tick
        measured.block[:] = state.block
        for fault, name in self._noises:
            if fault.acts_at(tick):
                values: Array = getattr(measured, name)
                if name == "quaternion":
                    values[:] = turned(values, fault.noise(tick, 3))
                else:
                    values += fault.noise(tick, values.size)
        for fault, name in self._quantisers:
            if fault.acts_at(tick):
                values = getattr(measured, name)
                if name == "quaternion":
                    values[:] = turned(IDENTITY, in_steps(rotation_vector(values), fault.value))
                else:
                    values[:] = in_steps(values, fault.value)
        return measured


def in_steps(values: Array, step: float) -> Array:
    """The nearest whole multiples of ``step``."""
    return step * np.round(values / step)


def turned(quaternion: Array, rotation: Array) -> Array:
    """``quaternion`` turned by a rotation vector on inertial axes, rad."""
    change = np.empty(4)
    quaternion_rate(quaternion, rotation, change)  # exp(rotation / 2) = cos + sinc rotation / 2
    half = 0.5 * float(np.linalg.norm(rotation))
    result: Array = np.cos(half) * quaternion + np.sinc(half / np.pi) * change
    return result


def rotation_vector(quaternion: Array) -> Array:
    """Axis times angle of a unit quaternion, rad; up to 2 pi, so that its sign is kept."""
    sine = float(np.linalg.norm(quaternion[1:]))
    angle = 2.0 * np.arctan2(sine, quaternion[0])
    return quaternion[1:] * (angle / sine) if sine else np.zeros(3)
