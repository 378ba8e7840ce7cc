"""Torques from outside, as the true state tells them: formulas, and the momentum that they give."""

from __future__ import annotations

from decimal import Decimal, localcontext

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from orbiting_robots import (
    ANGLES_DEG,
    DIGITS,
    LOCKED,
    MOTORS,
    MU,
    NO_FRICTION,
    angular_momentum,
    body_motions,
    centre_of_mass,
    coast,
    exact,
    orbiting_plant,
    plus,
    rigid_robot,
    set_motion,
    times,
    whole_inertia,
)
from paths import CONFIG
from random_robots import random_quaternion, random_robot
from scipy.integrate import simpson

from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import RobotState
from space_robot_sim.plant.surroundings import REPORT_TICKS

Array = NDArray[np.float64]

PAPER = Robot.from_yaml(CONFIG / "robots/paper.yaml")
ELEMENTS = {"height": 420e3, "inclination_deg": 51.6, "raan_deg": 30.0, "anomaly_deg": 20.0}


def gradient_of_rigid_body(robot: Robot, state: RobotState) -> Array:
    """Return ``3 mu / r^3 u x I u`` at the common centre of mass, N m, inertial axes."""
    r = state.orbit_position + centre_of_mass(robot, state)
    distance = float(np.linalg.norm(r))
    u = r / distance
    return np.asarray(3.0 * MU / distance**3 * np.cross(u, whole_inertia(robot, state) @ u))


def gradient_of_bodies(robot: Robot, state: RobotState) -> Array:
    """Return the moment of all bodies' weights about the common centre of mass, of many digits."""
    com, total = centre_of_mass(robot, state), np.zeros(3)
    with localcontext() as context:
        context.prec = DIGITS
        point = exact(state.orbit_position)
        below = -Decimal(MU) / times(point, point).sqrt() ** 3
        for body in body_motions(robot, state):
            place = plus(point, exact(body.position))
            fall = -Decimal(MU) / times(place, place).sqrt() ** 3
            weight = [
                body.mass * float(fall * a - below * b) for a, b in zip(place, point, strict=True)
            ]
            r = np.array([float(x) for x in place])
            u = r / np.linalg.norm(r)
            rate = 3.0 * MU / np.linalg.norm(r) ** 3
            pull = 0.5 * np.trace(body.inertia) - 2.5 * u @ body.inertia @ u
            lift = -rate / np.linalg.norm(r) * (body.inertia @ u + pull * u)
            total += np.cross(body.position - com, weight + lift)
            total += rate * np.cross(u, body.inertia @ u)
    return total


@settings(max_examples=25)
@given(st.integers(0, 10**6))
def test_gravity_gradient_is_that_of_a_rigid_body(seed: int) -> None:
    """Of any robot in any posture, to d / R; and of its bodies' weights, to rounding."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, MOTORS)
    plant = orbiting_plant(
        robot,
        0.5,
        orbital_elements=ELEMENTS,
        initial_quaternion=random_quaternion(rng).tolist(),
        initial_joints_deg=rng.uniform(-180.0, 180.0, MOTORS).tolist(),
    )
    set_motion(plant, position=rng.normal(size=3))
    torque = plant.truth.external_torques[:3]
    size = 3.0 * MU / np.linalg.norm(plant.truth.orbit_position) ** 3
    size *= np.linalg.norm(whole_inertia(robot, plant.truth))
    of_bodies = gradient_of_bodies(robot, plant.truth)
    np.testing.assert_allclose(torque, of_bodies, rtol=0, atol=1e-13 * size)
    of_whole = gradient_of_rigid_body(robot, plant.truth)
    np.testing.assert_allclose(torque, of_whole, rtol=0, atol=5.0 / 6.8e6 * size)


def test_a_ball_feels_no_gradient() -> None:
    plant = orbiting_plant(rigid_robot(100.0, [20.0] * 3), 0.5, orbital_elements=ELEMENTS)
    assert np.abs(plant.truth.external_torques[:3]).max() < 1e-18


@pytest.mark.parametrize("friction", [LOCKED, NO_FRICTION], ids=["locked", "free"])
def test_the_torque_told_is_what_turns_the_robot(friction: object) -> None:
    """The change of the angular momentum about the centre of mass is its integral."""
    plant = orbiting_plant(
        PAPER,
        0.25,
        orbital_elements=ELEMENTS,
        initial_joints_deg=ANGLES_DEG,
        initial_quaternion=[0.3, -0.8, 0.4, 0.2],
        friction=friction,
        gravity={"gradient": True, "j2": True},
    )
    set_motion(plant, position=[1.0, 2.0, -0.5], omega=[0.002, -0.001, 0.0015])
    torques, momenta = [], []
    for part in range(201):
        state = coast(plant, REPORT_TICKS if part else 0)
        torques.append(state.external_torques[:3].copy())
        momenta.append(angular_momentum(PAPER, state))
    impulse = simpson(torques, dx=REPORT_TICKS * plant.period, axis=0)
    change = momenta[-1] - momenta[0]
    size = np.linalg.norm(impulse)
    assert size > 0.1
    np.testing.assert_allclose(change, impulse, rtol=0, atol=1e-8 * size)


def test_the_gradient_is_told_every_few_ticks_and_the_rest_at_each() -> None:
    """It is held in between, since it costs as much as a stage of the step."""
    plant = orbiting_plant(
        PAPER,
        0.5,
        orbital_elements=ELEMENTS,
        initial_joints_deg=ANGLES_DEG,
        sunlight={"pressure": 4.56e-6, "noon_deg": 20.0},
        atmosphere={"density": 1e-12},
        magnetism={"strength": 3e-5, "residual_dipole": [1.0, 2.0, 3.0]},
    )
    set_motion(plant, omega=[0.01, 0.02, 0.015])
    rows = [coast(plant, min(tick, 1)).external_torques.copy() for tick in range(45)]
    changes = np.diff(rows, axis=0) != 0.0
    changed = np.flatnonzero(changes[:, :3].any(axis=1)) + 1
    np.testing.assert_array_equal(changed, [REPORT_TICKS, 2 * REPORT_TICKS])
    for source in (1, 2, 3):
        assert changes[:, 3 * source : 3 * source + 3].any(axis=1).all(), source


def test_without_an_orbit_nothing_of_it_is_told() -> None:
    plant = orbiting_plant(PAPER, 0.5, orbital_elements={}, gravity={})
    set_motion(plant, omega=[0.01, 0.0, 0.0])
    state = coast(plant, 3)
    for name in ("orbit_position", "orbit_velocity", "magnetic_field", "external_torques"):
        assert not np.any(getattr(state, name)), name
