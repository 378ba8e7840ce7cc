"""The plant and its peers behind one face: the same robot, the same start, steps of 0.5 ms.

A state is that of the plant: ``[r0, quaternion, theta, v0, w0, thetadot]``, velocities on
inertial axes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import mujoco
import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from oracles import (
    mujoco_model,
    pinocchio_acceleration,
    pinocchio_model,
    pinocchio_state,
    rotation_of,
)
from strategies import State

from space_robot_model.dynamics.attitude import quaternion_rate
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import MOST_WHEELS
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.plant.plant import Plant, PlantSettings

from ..kernels import forward_dynamics_calls, plant_steps

Array = NDArray[np.float64]

PERIOD = 5e-4
BATCH = 64
"""Calls of ``pin.aba`` that C++ makes in a row."""
FRICTION = FrictionSettings()


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
        """Everything turns."""
        n = robot.n
        rng = np.random.default_rng(n)
        quaternion = np.array([0.8, 0.36, -0.48, 0.0])
        return cls(
            robot,
            quaternion,
            rng.uniform(-1.0, 1.0, n),
            rng.uniform(-rate, rate, 3),
            rng.uniform(-rate, rate, 3),
            rng.uniform(-rate, rate, n),
            torque * rng.uniform(-1.0, 1.0, n + 3),
        )

    @property
    def x(self) -> Array:
        """The plant's state."""
        parts = (np.zeros(3), self.quaternion, self.theta, self.v0, self.w0, self.rate)
        return np.concatenate(parts)


class Peer(Protocol):
    """Something that integrates a robot."""

    name: str

    def step(self, steps: int) -> None:
        """Integrate ``steps`` steps of `PERIOD`, in compiled code."""

    @property
    def x(self) -> Array:
        """The state reached."""


class Ours:
    """The plant; with an environment: friction and disturbances of case 3."""

    name = "space_robot"

    def __init__(self, start: Start, with_environment: bool) -> None:
        n = start.robot.n
        scale = 1.0 if with_environment else 0.0
        settings = PlantSettings(
            initial_joints_deg=[0.0] * n,
            friction=FRICTION if with_environment else FrictionSettings(coulomb=0.0, viscous=0.0),
            disturbance=DisturbanceSettings(scale=scale),
        )
        self.plant = Plant(start.robot, settings, PERIOD)
        self._size = start.x.size
        self.plant.block[0].x[: self._size] = start.x
        self._torque, self._ticks = start.torque.copy(), 0
        self._force = np.zeros(n + 6 + MOST_WHEELS)

    def step(self, steps: int) -> None:
        plant_steps(
            self.plant.block,
            self.plant.command_delay_buffer,
            self._torque,
            self._ticks,
            steps,
            PERIOD,
        )
        self._ticks += steps

    def forward_dynamics(self, calls: int) -> None:
        """In the present state."""
        forward_dynamics_calls(self.plant.block, self._force, calls)

    @property
    def x(self) -> Array:
        return np.array(self.plant.block[0].x[: self._size])


class MuJoCo:
    """``mj_step`` with RK4, its loop over steps in C; contacts and all sensors off.

    Viscous friction is joint damping. Coulomb friction is MuJoCo's ``frictionloss``, a constraint
    for its solver; without it no constraint is left.
    """

    def __init__(self, start: Start, viscous: float = 0.0, coulomb: float = 0.0) -> None:
        self.name = "mujoco, friction loss" if coulomb else "mujoco"
        self.model = model = mujoco_model(start.robot)
        model.opt.timestep = PERIOD
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        off = mujoco.mjtDisableBit
        for bit in (
            off.mjDSBL_CONTACT,
            off.mjDSBL_LIMIT,
            off.mjDSBL_EQUALITY,
            off.mjDSBL_SENSOR,
            off.mjDSBL_ACTUATION,
            off.mjDSBL_GRAVITY,
            off.mjDSBL_SPRING,
        ):
            model.opt.disableflags |= bit
        if not coulomb:
            model.opt.disableflags |= off.mjDSBL_CONSTRAINT
        model.dof_damping[6:] = viscous
        model.dof_frictionloss[6:] = coulomb
        self.data = data = mujoco.MjData(model)
        data.qpos[3:7], data.qpos[7:] = start.quaternion, start.theta
        data.qvel[:3], data.qvel[6:] = start.v0, start.rate
        data.qvel[3:6] = rotation_of(start.quaternion).inv().apply(start.w0)
        data.qfrc_applied[3:] = start.torque

    def step(self, steps: int) -> None:
        mujoco.mj_step(self.model, self.data, steps)

    @property
    def x(self) -> Array:
        q, v = self.data.qpos, self.data.qvel
        w0 = rotation_of(q[3:7]).apply(v[3:6])
        return np.concatenate([q, v[:3], w0, v[6:]])


class Pinocchio:
    """Articulated bodies by Pinocchio; the integrator around them is here, at Python's speed."""

    name = "pinocchio"

    def __init__(self, start: Start) -> None:
        self.model = pinocchio_model(start.robot)
        self.data = self.model.createData()
        self._x, self._torque = start.x, start.torque
        self._now = pinocchio_state(
            State(start.quaternion, start.theta, start.v0, start.w0, start.rate)
        )
        self._force = np.zeros(self.model.nv)
        self._rate = np.empty(4)
        self._pool = pin.ModelPool(self.model, 1)
        columns = (*self._now, self._force)
        self._columns = [np.asfortranarray(np.tile(c[:, None], BATCH)) for c in columns]
        self._batch = np.zeros((self.model.nv, BATCH), order="F")

    def calls(self, calls: int) -> None:
        """``pin.aba`` in the first state, from Python."""
        model, data, force, (position, velocity) = self.model, self.data, self._force, self._now
        for _ in range(calls):
            pin.aba(model, data, position, velocity, force)

    def batches_in_cpp(self, batches: int) -> None:
        """`BATCH` times the same with the loop in C++, on one thread, for each of ``batches``."""
        for _ in range(batches):
            pin.abaInParallel(1, self._pool, *self._columns, self._batch)

    def assert_batches_are_calls(self) -> None:
        """See that both ways compute the same."""
        self.batches_in_cpp(1)
        one = pin.aba(self.model, self.data, *self._now, self._force)
        np.testing.assert_allclose(self._batch, np.tile(one[:, None], BATCH), rtol=1e-12)

    def step(self, steps: int) -> None:
        for _ in range(steps):
            x, slopes = self._x, [self._slope(self._x)]
            for part in (0.5, 0.5, 1.0):
                slopes.append(self._slope(x + part * PERIOD * slopes[-1]))
            a, b, c, d = slopes
            self._x = x + PERIOD / 6.0 * (a + 2.0 * (b + c) + d)

    def _slope(self, x: Array) -> Array:
        n = self.model.nv - 6
        quaternion, theta = x[3:7] / np.linalg.norm(x[3:7]), x[7 : 7 + n]
        v0, w0, rate = x[7 + n : 10 + n], x[10 + n : 13 + n], x[13 + n :]
        turned = rotation_of(quaternion).apply(self._torque[:3])
        force = np.concatenate([np.zeros(3), turned, self._torque[3:]])
        quaternion_rate(quaternion, w0, self._rate)
        state = State(quaternion, theta, v0, w0, rate)
        acceleration = pinocchio_acceleration(self.model, self.data, state, force)
        return np.concatenate([v0, self._rate, rate, acceleration])

    @property
    def x(self) -> Array:
        return self._x
