"""Arms with gears on a free base against SciPy, by equations that have the rotors as bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from geared_robots import PERIOD, GearedFlight, random_gears, rotor_room, with_gears
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import rotation_of
from random_robots import random_quaternion, random_robot, random_state
from rotor_equations import RotorEquations
from rotor_oracles import pinocchio_rotor_accelerations, random_motor_rotors, turns

from space_robot_model.robot import Robot
from space_robot_model.robot.tree import Gear

Array = NDArray[np.float64]

SUBSTEPS, TICKS = 4, 300


def geared_arm(rng: np.random.Generator, slides: list[bool]) -> Robot:
    """Return an arm with a gear on every joint, rotors heavy enough to turn their carriers."""
    robot = random_robot(rng, len(slides))
    robot = replace(robot, is_prismatic=np.array(slides))
    gears = [
        Gear(
            float(rng.uniform(0.05, 0.1)) * min(rotor_room(robot, joint), 1.0),
            float(rng.uniform(4.0, 8.0)),
            float(rng.uniform(500.0, 1500.0)),
            float(rng.uniform(0.0, 0.5)),
        )
        for joint in range(robot.n)
    ]
    return with_gears(robot, gears)


@given(st.sampled_from([1, 2, 3, 6]), st.integers(0, 2**32 - 1))
@settings(max_examples=40)
def test_the_equations_are_pinocchios(n: int, seed: int) -> None:
    """Those that the flights below are compared with: accelerations to 1e-12."""
    rng = np.random.default_rng(seed)
    robot = random_gears(rng, replace(random_robot(rng, n), is_prismatic=rng.random(n) < 0.3))
    rotors, state = random_motor_rotors(rng, robot), random_state(rng, n)
    equations, scale = RotorEquations(robot, rotors), turns(robot)
    spins = rng.normal(size=len(rotors))
    force = rng.normal(size=equations.size) * scale
    velocity = np.concatenate([state.velocity, spins])
    mass, bias = equations.matrices(state.quaternion, state.theta, velocity)
    actual = np.linalg.solve(mass, force - bias) * scale
    expected = pinocchio_rotor_accelerations(robot, rotors, state, spins, force) * scale
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("slides", [[False, False], [False, True], [True, False]])
def test_a_flight_is_the_one_that_scipy_integrates(slides: list[bool]) -> None:
    """Two joints, thrown, in two holds of torque on base and motors: 0.3 s, each number to 1e-9."""
    rng = np.random.default_rng(7 + slides.index(True) if any(slides) else 3)
    robot = geared_arm(rng, slides)
    rotors, n, viscous = random_motor_rotors(rng, robot), robot.n, 0.3
    equations = RotorEquations(robot, rotors)
    flight = GearedFlight(
        robot, SUBSTEPS, viscous=viscous, initial_quaternion=random_quaternion(rng).tolist()
    )
    flight.positions[:] = rng.uniform(-1.0, 1.0, n)
    flight.motor_positions[:] = flight.positions + rng.uniform(-0.05, 0.05, n)
    flight.base_velocities[:] = rng.normal(size=6)
    flight.velocities[:], flight.motor_velocities[:] = 2.0 * rng.normal(size=(2, n))
    x, start = flight.x.copy(), flight.x.copy()
    for torque in (10.0 * rng.normal(size=3 + n), 10.0 * rng.normal(size=3 + n)):

        def force(_: float, y: Array, torque: Array = torque) -> Array:
            motors = torque[3:] - viscous * equations.parts(y)[2]
            of_base = rotation_of(y[3:7]).apply(torque[:3])
            return np.concatenate([np.zeros(3), of_base, np.zeros(n), motors])

        x = equations.fly(x, TICKS * PERIOD, force)
        x[3:7] /= np.linalg.norm(x[3:7])
        flight.fly(torque, TICKS)
        np.testing.assert_allclose(flight.x, x, rtol=1e-9, atol=0.0)
    assert np.abs(flight.x - start).min() > 1e-3
    stretched = np.abs(flight.motor_positions - flight.positions)
    assert stretched.max() > 1e-3
