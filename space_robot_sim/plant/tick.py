"""One tick of the plant: its memory, and the kernels that take it from a tick to the next."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.algebra import (
    Vector,
    add,
    cross,
    dot,
    scale,
    store,
    subtract,
    vector,
)
from space_robot_model.dynamics.attitude import rotate, rotate_back, rotation_matrix
from space_robot_model.dynamics.kinematics import forward_kinematics
from space_robot_model.dynamics.model import Data, Model
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import uniform, where, whole
from space_robot_msgs_py.compiled.records import Record, nested, shaped
from space_robot_msgs_py.samples import State

from ..actuators.actuators import Actuators, actuate
from ..environment.disturbance import begin_loads
from ..environment.environment import Environment
from ..environment.gravity_gradient import add_gravity_gradient
from ..environment.orbit import density_at, light, magnetic_field, wind
from ..environment.surfaces import fill_surface_wrenches
from ..sensors.sensors import Sensors, sense
from .integrator import MOST_NUMBERS, Stages, first_motor_angle, first_orbit_number, integrate

Array = NDArray[np.float64]
Block = NDArray[Any]


@kernel
def write_truth(model: Model, x: Array, rotation: Array, truth: State) -> None:
    """Write the plant's state ``x`` (see `Stages`) into ``truth``; the torque there is left alone.

    ``rotation`` (3, 3) is scratch.
    """
    n, actuated = whole(model.joint_count), truth.joint_positions.size
    truth.base_position[:] = x[:3]
    truth.quaternion[:] = x[3:7]
    truth.base_velocity[:] = x[7 + n : 10 + n]
    rotation_matrix(truth.quaternion, rotation)
    rotate_back(rotation, x[10 + n : 13 + n], truth.omega_base)
    positions, velocities = x[7 : 7 + n], x[13 + n : 13 + 2 * n]
    for i in range(actuated):
        j = whole(model.row[i])
        truth.joint_positions[i], truth.joint_velocities[i] = positions[j], velocities[j]
    for i in range(actuated, n):
        j, passive = whole(model.row[i]), i - actuated
        truth.passive_positions[passive] = positions[j]
        truth.passive_velocities[passive] = velocities[j]
    for k in range(whole(model.wheel_count)):
        truth.wheel_velocities[k] = x[13 + 2 * n + k]
    velocity = 13 + 2 * n + whole(model.wheel_count)
    angle = velocity + whole(model.rotor_count)
    for k in range(whole(model.rotor_count)):
        truth.motor_positions[k], truth.motor_velocities[k] = x[angle + k], x[velocity + k]


REPORT_TICKS = 20
"""Ticks between two reports of gravity's torque, which costs as much as a stage of the step."""


@kernel
def update_surroundings(
    model: Model,
    environment: Environment,
    x: Array,
    data: Data,
    tick: int,
    period: float,
    truth: State,
) -> None:
    """Compute what acts over the tick that begins, and write it into ``truth``.

    ``x`` and the attitude in ``truth`` are those of the tick; ``data`` is scratch.
    """
    orbit, surfaces = environment.orbit, environment.surfaces
    if uniform(orbit.is_on) == 0.0:
        return
    n, at = whole(model.joint_count), first_orbit_number(model)
    position, velocity = x[at : at + 3], x[at + 3 : at + 6]
    truth.orbit_position[:] = position
    truth.orbit_velocity[:] = velocity
    forward_kinematics(model, x[3:7], x[7 : 7 + n], data)
    torques = truth.external_torques
    com = centre_of_mass(model, data)
    if uniform(surfaces.count) > 0.0:
        place = add(vector(position, 0), vector(x, 0))
        motion = add(vector(velocity, 0), vector(x, 7 + n))
        store(wind(place, motion), orbit.wind, 0)
        density = density_at(orbit, np.sqrt(dot(place, place)))
        pressure = orbit.pressure * light(orbit, place)
        fill_surface_wrenches(surfaces, model, orbit.wind, density, orbit.sun, pressure, data)
        store(_about(com, surfaces.drag), torques, 3)
        store(_about(com, surfaces.sunlight), torques, 6)
    magnetic_field(orbit, position, tick * period, orbit.field)
    rotate_back(data.rotation, orbit.field, truth.magnetic_field)
    torque = cross(vector(orbit.residual_dipole, 0), vector(truth.magnetic_field, 0))
    store(torque, orbit.magnetic_torque, 0)
    rotate(data.rotation, orbit.magnetic_torque, torques[9:12])
    if uniform(orbit.has_gradient) != 0.0 and tick % REPORT_TICKS == 0:
        for i in range(n + 1):
            data.bias[i] = 0.0
        add_gravity_gradient(model, position, x[:3], orbit.has_j2, data)
        # bias forces oppose what acts; about the base's CoM, then about the robot's
        moment, force = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        for i in range(n + 1):
            moment = subtract(moment, vector(data.bias[i], 0))
            force = subtract(force, vector(data.bias[i], 3))
        store(subtract(moment, cross(com, force)), torques, 0)


@subroutine
def _about(com: Vector, wrench: Array) -> Vector:
    """Return the moment about ``com`` of a wrench (6,) about the base's CoM."""
    return subtract(vector(wrench, 0), cross(com, vector(wrench, 3)))


@subroutine
def centre_of_mass(model: Model, data: Data) -> Vector:
    """Return the robot's centre of mass from the base's, inertial axes, m."""
    mass, moment = 0.0, (0.0, 0.0, 0.0)
    for i in range(whole(model.joint_count) + 1):
        mass = mass + model.mass[i]
        moment = add(moment, vector(data.first_moment[i], 0))
    return scale(moment, 1.0 / mass)


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
    """Call `write_true_state` from Python."""
    write_true_state(block[0], tick, period)


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
def write_true_state(memory: PlantMemory, tick: int, period: float) -> None:
    """Write the true state of ``tick``, and what the robot meets there."""
    write_truth(memory.model, memory.x, memory.rotation, memory.truth)
    update_surroundings(
        memory.model, memory.environment, memory.x, memory.stages.data, tick, period, memory.truth
    )


@kernel
def end_interval(memory: PlantMemory, tick: int, period: float) -> float:
    """Write the true state of ``tick``, which is reached, and return its `fastest_rate`."""
    write_true_state(memory, tick, period)
    fastest: float = fastest_rate(memory.model, memory.x)
    return fastest


@kernel
def fastest_rate(model: Model, x: Array) -> float:
    """Return the fastest rate of base axes, joints, wheels and motors, rad/s (NaN if any is)."""
    fastest = 0.0
    for i in range(10 + whole(model.joint_count), first_motor_angle(model)):
        speed = abs(x[i])  # a NaN stays: it compares as false
        fastest = where((speed <= fastest) | np.isnan(fastest), fastest, speed)
    return fastest
