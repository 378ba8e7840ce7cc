"""What a robot meets in orbit at a tick: gravity, air, sunlight, and the magnetic field."""

from __future__ import annotations

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
from space_robot_model.dynamics.attitude import rotate, rotate_back
from space_robot_model.dynamics.kinematics import forward_kinematics
from space_robot_model.dynamics.model import Data, Model
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import uniform, whole
from space_robot_msgs_py.samples import State

from ..environment.environment import Environment
from ..environment.gravity_gradient import add_gravity_gradient
from ..environment.orbit import density_at, light, magnetic_field, wind
from ..environment.surfaces import press_on_surfaces
from .integrator import first_orbit_number

Array = NDArray[np.float64]

REPORT_TICKS = 20
"""Ticks between two looks at the torque of gravity, which costs as much as a stage of the step."""


@kernel
def meet_surroundings(
    model: Model,
    environment: Environment,
    x: Array,
    data: Data,
    tick: int,
    period: float,
    truth: State,
) -> None:
    """Find what acts over the tick that begins, and write it into ``truth``.

    Args:
        model: of the plant's robot.
        environment: its orbit and surfaces; field and wrenches are written.
        x: the state, see `space_robot_sim.plant.integrator.Stages`.
        data: scratch.
        tick: the tick.
        period: s.
        truth: with the base's attitude.
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
        press_on_surfaces(surfaces, model, orbit.wind, density, orbit.sun, pressure, data)
        store(_about(com, surfaces.drag), torques, 3)
        store(_about(com, surfaces.sunlight), torques, 6)
    magnetic_field(orbit, position, tick * period, orbit.field)
    rotate_back(data.rotation, orbit.field, truth.magnetic_field)
    torque = cross(vector(orbit.residual_dipole, 0), vector(truth.magnetic_field, 0))
    store(torque, orbit.magnetic_torque, 0)
    rotate(data.rotation, orbit.magnetic_torque, torques[9:12])
    if uniform(orbit.has_gradient) != 0.0 and tick % REPORT_TICKS == 0:
        data.bias[: n + 1] = 0.0
        add_gravity_gradient(model, position, x[:3], orbit.has_j2, data)
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
