"""One tick of the plant: its memory, and the kernels that take it from a tick to the next."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.model import Model
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import uniform, where, whole
from space_robot_msgs_py.compiled.records import Record, nested, shaped
from space_robot_msgs_py.samples import State

from ..actuators.actuators import Actuators, actuate
from ..environment.environment import Environment
from ..environment.loads import begin_loads
from ..sensors.sensors import Sensors, sense
from .integrator import MOST_NUMBERS, Stages, first_motor_angle
from .stick_slip import integrate
from .surroundings import meet_surroundings
from .truth import write_truth

Array = NDArray[np.float64]
Block = NDArray[Any]

RATE_LIMIT = 1e4
"""rad/s; a body that turns faster has left the physics (a diverged loop)."""


class PlantMemory(Record):
    """The memory that a step of the plant reads and writes."""

    model: Model = nested(Model)
    environment: Environment = nested(Environment)
    actuators: Actuators = nested(Actuators)
    sensors: Sensors = nested(Sensors)
    stages: Stages = nested(Stages)
    substeps: float = shaped(lambda n: (), uniform=True)
    """Integration steps in a tick."""
    x: Array = shaped(lambda n: (MOST_NUMBERS,))
    """State vector, see `Stages`."""
    rotation: Array = shaped(lambda n: (3, 3))
    """Scratch."""
    truth: State = nested(State)
    """The true state at the current tick, and the torque given over the interval before it."""
    measured: State = nested(State)
    """The state as the sensors report it at the current tick."""


@kernel
def step(
    block: Block,
    command_delay_buffer: Array,
    torque: Array,
    tick: int,
    period: float,
    goes_on: bool,
) -> float:
    """Call `advance` from Python and, if ``goes_on``, let the sensors measure the next tick."""
    memory = block[0]
    fastest: float = advance(memory, command_delay_buffer, torque, tick, period)
    if goes_on:
        sense(memory.sensors, memory.truth, tick + 1, period, memory.measured)
    return fastest


@kernel
def update_true_state(block: Block, tick: int, period: float) -> None:
    """Call `look` from Python."""
    look(block[0], tick, period)


@kernel
def measure(block: Block, tick: int, period: float) -> None:
    """Call `sense` from Python."""
    memory = block[0]
    sense(memory.sensors, memory.truth, tick, period, memory.measured)


@kernel
def advance(
    memory: PlantMemory, command_delay_buffer: Array, torque: Array, tick: int, period: float
) -> float:
    """Fly from ``tick`` to the next under the command ``torque`` (n+3+A,) given at ``tick``.

    The sensors have not measured the next tick then: see `sense`.

    Returns:
        The fastest rate then, see `fastest_rate`.
    """
    begin_interval(memory, command_delay_buffer, torque, tick, period)
    substeps = whole(memory.substeps)
    step = period / substeps
    for k in range(substeps):
        integrate(
            memory.model,
            memory.environment,
            memory.x,
            tick * period + k * step,
            step,
            memory.stages,
        )
    fastest: float = end_interval(memory, tick + 1, period)
    return fastest


@kernel
def begin_interval(
    memory: PlantMemory, command_delay_buffer: Array, torque: Array, tick: int, period: float
) -> None:
    """Let the actuators answer a command given at ``tick``, see `advance`."""
    truth, actuation = memory.truth, memory.stages.actuation
    actuate(memory.actuators, command_delay_buffer, torque, tick, period, truth, memory.measured)
    n, joints = truth.joint_positions.size, whole(memory.model.joint_count)
    actuation[:6] = memory.actuators.base_wrench
    actuation[6 : 6 + n] = truth.applied_torque[3:]
    for k in range(whole(memory.model.wheel_count)):
        actuation[6 + joints + k] = truth.wheel_torques[k]
    if uniform(memory.environment.loads.is_on) != 0.0:
        begin_loads(memory.environment.loads, tick, period, actuation[:6])


@kernel
def look(memory: PlantMemory, tick: int, period: float) -> None:
    """Write the true state of ``tick``, and what the robot meets there."""
    write_truth(memory.model, memory.x, memory.rotation, memory.truth)
    meet_surroundings(
        memory.model, memory.environment, memory.x, memory.stages.data, tick, period, memory.truth
    )


@kernel
def end_interval(memory: PlantMemory, tick: int, period: float) -> float:
    """Write the true state of ``tick``, which is reached, and return its `fastest_rate`."""
    look(memory, tick, period)
    fastest: float = fastest_rate(memory.model, memory.x)
    return fastest


@kernel
def fastest_rate(model: Model, x: Array) -> float:
    """Return the fastest rate of base axes, joints, wheels and motors, rad/s (NaN if any is)."""
    fastest = 0.0
    for i in range(10 + whole(model.joint_count), first_motor_angle(model)):
        speed = abs(x[i])  # NaN stays
        fastest = where((speed <= fastest) | np.isnan(fastest), fastest, speed)
    return fastest
