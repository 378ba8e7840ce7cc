"""The plant: the robot in its environment, stepped tick by tick. Knows no ROS."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, assign, nested, shaped
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import DivergedError, InputError
from space_robot_msgs_py.samples import Command, RobotState, State

from ..dynamics.attitude import rotate_back, rotation_matrix
from ..dynamics.model import Model
from ..environment.environment import (
    DisturbanceSettings,
    Environment,
    FrictionSettings,
    PayloadSettings,
    with_payload,
)
from ..robot import Robot
from .integrator import Stages, rk4_step

Array = NDArray[np.float64]
Block = NDArray[Any]

RATE_LIMIT = 1e4
"""rad/s; a body that turns faster has left the physics (a diverged loop)."""


class PlantSettings(StrictModel):
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


class PlantMemory(Record):
    """All that a step of the plant reads and writes."""

    model: Model = nested(Model)
    environment: Environment = nested(Environment)
    stages: Stages = nested(Stages)
    x: Array = shaped(lambda n: (2 * n + 13,))
    """The state, see `Stages`."""
    limit: Array = shaped(lambda n: (n + 3,))
    """Largest torque on each axis, N m."""
    saturated_ticks: float = shaped(lambda n: ())
    """Ticks so far in which a torque was at its limit."""
    rotation: Array = shaped(lambda n: (3, 3))
    """Scratch."""
    measured: State = nested(State)
    """What the sensors report at the current tick."""


class Plant:
    """Integrates the robot at a fixed period; a command is held over one tick.

    `state` is what the sensors report at the current tick; `step` applies a command until the
    next one. Momentum and energy follow from `state` alone (`space_robot_sim.plant.conservation`).
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
        if not 1e-3 <= norm <= 1e3:
            raise InputError(f"initial_quaternion must have a norm near 1, got {norm:g}")
        self.robot = with_payload(robot, settings.payload)
        self.period = period
        self.block = PlantMemory.block(n)
        """The plant's `PlantMemory`, for compiled loops."""
        self.command_delay_buffer = np.zeros((settings.command_latency_ticks, n + 3))
        """Ring of the commands that are still on their way."""
        memory: PlantMemory = self.block[0]
        environment = Environment.build(n, settings.friction, settings.disturbance)
        assign(memory, model=self.robot.model, environment=environment)
        memory.x[3:7] = np.array(settings.initial_quaternion) / norm
        memory.x[7 : 7 + n] = np.radians(settings.initial_joints_deg)
        memory.limit[:] = settings.joint_torque_limit or np.inf
        memory.limit[:3] = settings.base_torque_limit or np.inf
        self.state = RobotState(0, self.block["measured"])
        # at rest: what `measure` would say, without waiting for compiled code
        self.state.quaternion[:] = memory.x[3:7]
        self.state.joint_positions[:] = memory.x[7 : 7 + n]

    @property
    def tick(self) -> int:
        """Ticks flown so far."""
        return self.state.tick

    @property
    def torque_limit(self) -> Array:
        """(n+3,) largest torque of each axis, N m; may be changed in flight."""
        memory: PlantMemory = self.block[0]
        return memory.limit

    @property
    def coulomb_friction(self) -> Array:
        """(n,) Coulomb friction of each joint, N m; may be changed in flight."""
        memory: PlantMemory = self.block[0]
        return memory.environment.coulomb

    @property
    def saturated_ticks(self) -> int:
        """Ticks so far in which a torque was at its limit."""
        memory: PlantMemory = self.block[0]
        return int(memory.saturated_ticks)

    def step(self, command: Command) -> None:
        """Hold ``command`` (or the one due, if commands are delayed) over one tick.

        Raises:
            DivergedError: the state is no longer finite, or turns faster than `RATE_LIMIT`.
        """
        tick = self.state.tick
        fastest = step(self.block, self.command_delay_buffer, command.torque, tick, self.period)
        self.state.tick = tick + 1
        if not fastest <= RATE_LIMIT:
            raise self.diverged(fastest)

    def diverged(self, fastest: float) -> DivergedError:
        """What to raise when the fastest rate after a step is ``fastest``."""
        why = "the state is not finite" if np.isnan(fastest) else f"{fastest:.3g} rad/s"
        return DivergedError(self.tick, self.period, why)


@kernel
def step(
    block: Block, command_delay_buffer: Array, torque: Array, tick: int, period: float
) -> float:
    """`advance` for callers from Python."""
    fastest: float = advance(block[0], command_delay_buffer, torque, tick, period)
    return fastest


@kernel
def advance(
    memory: PlantMemory, command_delay_buffer: Array, torque: Array, tick: int, period: float
) -> float:
    """Apply ``torque`` (n+3,) from ``tick`` to the next, or the one due from the delay buffer.

    Returns:
        The fastest rate then, see `measure`.
    """
    applied, limit, saturated = memory.measured.applied_torque, memory.limit, 0.0
    latency = command_delay_buffer.shape[0]
    for i in range(applied.size):
        due = torque[i]
        if latency > 0:
            due = command_delay_buffer[tick % latency, i]
            command_delay_buffer[tick % latency, i] = torque[i]
        applied[i] = min(max(due, -limit[i]), limit[i])
        if applied[i] != due:
            saturated = 1.0
    memory.saturated_ticks += saturated
    rk4_step(
        memory.model, memory.environment, memory.x, applied, tick * period, period, memory.stages
    )
    fastest: float = measure(memory)
    return fastest


@kernel
def measure(memory: PlantMemory) -> float:
    """Write what the sensors see; returns the fastest rate, rad/s (NaN if any is)."""
    x, measured = memory.x, memory.measured
    n = measured.joint_positions.size
    measured.base_position[:] = x[:3]
    measured.quaternion[:] = x[3:7]
    measured.joint_positions[:] = x[7 : 7 + n]
    measured.base_velocity[:] = x[7 + n : 10 + n]
    rotation_matrix(measured.quaternion, memory.rotation)
    rotate_back(memory.rotation, x[10 + n : 13 + n], measured.omega_base)
    measured.joint_velocities[:] = x[13 + n :]
    fastest = 0.0
    for i in range(10 + n, x.size):
        if not abs(x[i]) <= fastest:  # also true of NaN
            fastest = abs(x[i])
            if np.isnan(fastest):
                break
    return fastest
