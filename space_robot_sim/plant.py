"""The plant: the robot in its environment, stepped tick by tick. Knows no ROS."""

from __future__ import annotations

from collections import deque
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_msgs_py.errors import DivergedError, InputError
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_msgs_py.validation import Strict

from .environment import (
    DisturbanceSettings,
    Environment,
    FrictionSettings,
    PayloadSettings,
    with_payload,
)
from .integrator import Stages, measure, rk4_step, saturate
from .robot import Robot

Array = NDArray[np.float64]

RATE_LIMIT = 1e4
"""rad/s; a body that turns faster has left the physics (a diverged loop)."""


class PlantSettings(Strict):
    """What the plant is told about its world, beside the robot's own file."""

    friction: FrictionSettings = FrictionSettings()
    disturbance: DisturbanceSettings = DisturbanceSettings()
    payload: PayloadSettings = PayloadSettings()
    command_latency_ticks: Annotated[int, Field(ge=0, le=1000)] = Field(
        0, description="ticks by which a command is applied late"
    )
    base_torque_limit: Annotated[float, Field(ge=0.0, le=1e9)] = Field(
        0.0, description="largest torque on each base axis, N m (0: none)"
    )
    joint_torque_limit: Annotated[float, Field(ge=0.0, le=1e9)] = Field(
        0.0, description="largest torque on each joint, N m (0: none)"
    )
    initial_joints_deg: list[float] = Field(
        [0.0], description="joint angles at tick 0, degrees, one a joint"
    )
    initial_quaternion: Annotated[list[float], Field(min_length=4, max_length=4)] = Field(
        [1.0, 0.0, 0.0, 0.0], description="base attitude at tick 0: w, x, y, z"
    )


class Plant:
    """Integrates the robot at a fixed period; a command is held over one tick.

    `state` is what the sensors report at the current tick; `step` applies a command until the
    next one. Momentum and energy follow from `state` alone (`space_robot_sim.conservation`).
    """

    def __init__(self, robot: Robot, settings: PlantSettings, period: float) -> None:
        """Place the robot at rest.

        Raises:
            InputError: the initial configuration does not fit the robot.
        """
        n = robot.n
        if len(settings.initial_joints_deg) != n:
            raise InputError(
                f"initial_joints_deg has {len(settings.initial_joints_deg)} values, "
                f"robot {robot.name!r} has {n} joints"
            )
        norm = float(np.linalg.norm(settings.initial_quaternion))
        if norm < 1e-3:
            raise InputError(f"initial_quaternion must not be zero, got norm {norm:g}")
        self.robot = with_payload(robot, settings.payload)
        self.environment = Environment.build(n, settings.friction, settings.disturbance)
        self.period = period
        self.state = RobotState.allocate(n)
        self._x = np.zeros(2 * n + 13)
        self._x[3:7] = np.array(settings.initial_quaternion) / norm
        self._x[7 : 7 + n] = np.radians(settings.initial_joints_deg)
        self._stages = Stages.allocate(n)
        self._rotation = np.zeros((3, 3))
        self._late: deque[Array] = deque(
            np.zeros(n + 3) for _ in range(settings.command_latency_ticks)
        )
        self._limit = np.full(n + 3, settings.joint_torque_limit or np.inf)
        self._limit[:3] = settings.base_torque_limit or np.inf
        self._measure()

    @property
    def tick(self) -> int:
        """Ticks flown so far."""
        return self.state.tick

    def step(self, command: Command) -> None:
        """Hold ``command`` (or the one due, if commands come late) over one tick.

        Raises:
            DivergedError: the state is no longer finite, or turns faster than `RATE_LIMIT`.
        """
        applied = self.state.applied_torque
        if self._late:
            self._late.append(command.torque.copy())
            due = self._late.popleft()
        else:
            due = command.torque
        saturate(due, self._limit, applied)
        tick = self.state.tick
        rk4_step(
            self.robot.model, self.environment, self._x, applied, tick * self.period, self.period,
            self._stages,
        )  # fmt: skip
        self.state.tick = tick + 1
        self._measure()

    def _measure(self) -> None:
        state = self.state
        fastest = measure(
            self._x, self._rotation, state.base_position, state.quaternion, state.base_velocity,
            state.omega_base, state.joint_positions, state.joint_velocities,
        )  # fmt: skip
        if not fastest <= RATE_LIMIT:
            why = "the state is not finite" if np.isnan(fastest) else f"{fastest:.3g} rad/s"
            raise DivergedError(state.tick, self.period, why)
