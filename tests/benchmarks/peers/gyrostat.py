"""The satellite with its arm locked, turned by four wheels: the plant's side of a comparison.

A program beside it is told the rigid body, the wheels and the motors' torques; what it computes is
all its own.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from space_robot import mass_matrix
from space_robot_model.hardware.wheels import WheelSettings
from space_robot_model.robot import Robot
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.plant.plant import Plant, PlantSettings

from ..kernels import plant_steps

Array = NDArray[np.float64]

PERIOD = 5e-4
HELD_STEPS = 2000
"""Steps for which the motors' torques are held."""
UPRIGHT = np.array([1.0, 0.0, 0.0, 0.0])
LOCKED = FrictionSettings(coulomb=1e6, viscous=0.0)
"""The arm never breaks away."""


@dataclass(frozen=True)
class Gyrostat:
    """A robot, its arm's angles, its wheels, how it turns at first, and the motors' torques."""

    robot: Robot
    theta: Array
    wheels: WheelSettings
    quaternion: Array
    omega: Array
    """(3,) of the base, on its axes, rad/s."""
    torques: Array
    """(K, W) N m, each held for `HELD_STEPS`."""

    @classmethod
    def turning(cls, robot: Robot, seconds: int) -> Gyrostat:
        """Four wheels in a pyramid at different speeds, and torques that change every second."""
        rng = np.random.default_rng(4)
        wheels = WheelSettings(
            axes=[1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0],
            rotor_inertia=[0.2],
            initial_speed=[100.0, -60.0, 30.0, -150.0],
        )
        return cls(
            robot,
            rng.uniform(-1.0, 1.0, robot.n),
            wheels,
            np.array([0.8, 0.36, -0.48, 0.0]),
            np.array([0.01, -0.02, 0.015]),
            rng.uniform(-2.0, 2.0, (seconds, wheels.count)),
        )

    @property
    def inertia(self) -> Array:
        """(3, 3) of the whole with wheels and arm locked, about its centre of mass, kg m2."""
        locked = mass_matrix(self.robot, UPRIGHT, self.theta)[:6, :6]
        coupling = locked[:3, 3:]
        about_com: Array = locked[3:, 3:] - coupling.T @ np.linalg.solve(locked[:3, :3], coupling)
        return about_com


class Motion(Protocol):
    """Something that flies a `Gyrostat`."""

    name: str

    def fly(self, torque: Array) -> tuple[Array, Array, Array]:
        """Hold a torque (W,) for `HELD_STEPS`; then quaternion, omega and the wheels' speeds."""


class OurGyrostat:
    """The plant."""

    name = "space_robot"

    def __init__(self, start: Gyrostat) -> None:
        n = start.robot.n
        settings = PlantSettings(
            initial_quaternion=start.quaternion.tolist(),
            initial_joints_deg=np.degrees(start.theta).tolist(),
            friction=LOCKED,
            base_actuation="hardware",
            wheels=start.wheels,
        )
        self._plant = Plant(start.robot, settings, PERIOD)
        memory = self._plant.memory
        memory.x[7 : 7 + n] = start.theta
        self._quaternion, self._omega = memory.x[3:7], memory.truth.omega_base
        self._speeds = memory.truth.wheel_velocities[: start.wheels.count]
        w, v = start.quaternion[0], start.quaternion[1:]
        turned = start.omega + 2.0 * np.cross(v, np.cross(v, start.omega) + w * start.omega)
        memory.x[10 + n : 13 + n] = turned
        self._rest = np.zeros(n + 3)
        self._tick = 0

    def fly(self, torque: Array) -> tuple[Array, Array, Array]:
        plant, command = self._plant, np.concatenate([self._rest, torque])
        buffer = plant.command_delay_buffer
        plant_steps(plant.block, buffer, command, self._tick, HELD_STEPS, PERIOD)
        self._tick += HELD_STEPS
        return self._quaternion.copy(), self._omega.copy(), self._speeds.copy()


def apart(start: Gyrostat, one: Motion, other: Motion) -> Iterator[tuple[float, float]]:
    """Fly both; after each torque the largest difference of attitude and rates, and the motion.

    Attitude by the quaternion, whose sign means nothing; rates of the base, rad/s, and of the
    wheels, as shares of their own.
    """
    for torque in start.torques:
        (q, omega, speeds), (p, others, turns) = one.fly(torque), other.fly(torque)
        attitude = min(np.abs(q - p).max(), np.abs(q + p).max())
        rates = np.abs(omega - others).max()
        spins = (np.abs(speeds - turns) / np.abs(speeds)).max()
        moved = np.abs(q - start.quaternion).max()
        yield float(max(attitude, rates, spins)), float(moved)
