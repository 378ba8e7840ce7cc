"""The base's wheels against rotors that are bodies of their own: Pinocchio and MuJoCo."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import mujoco_acceleration, pinocchio_acceleration
from random_robots import State, random_robot, random_state
from wheel_oracles import Rotor, mount, mujoco_with_wheels, pinocchio_with_wheels, random_rotors

from space_robot_model.dynamics.aba import aba
from space_robot_model.dynamics.kinematics import forward_kinematics, spatial_velocities
from space_robot_model.dynamics.model import Data
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import MOST_WHEELS

Array = NDArray[np.float64]


def accelerations(robot: Robot, rotors: list[Rotor], state: State, force: Array) -> Array:
    """``[v0dot, w0dot, thetadd, Omegadot]`` by the plant's algorithm; ``state`` has all speeds."""
    model, data, out = robot.model.copy(), Data.allocate(robot.n), np.empty(force.size)
    mount(model, rotors)
    forward_kinematics(model, state.quaternion, state.theta[: robot.n], data)
    spatial_velocities(model, state.w0, state.rate, data)
    aba(model, state.w0, state.rate, force, data, out)
    return out


def moving(n: int, count: int, seed: int) -> tuple[Robot, list[Rotor], State, Array]:
    """A robot with wheels of some 1000 rpm, turned by any angle, and a force on everything."""
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, n)
    rotors = random_rotors(rng, robot, count)
    state = random_state(rng, n)._replace(
        theta=rng.uniform(-np.pi, np.pi, n + count),
        rate=np.concatenate([rng.normal(size=n), 100.0 * rng.normal(size=count)]),
    )
    return robot, rotors, state, rng.normal(size=6 + n + count)


@given(st.sampled_from([1, 6]), st.integers(1, MOST_WHEELS), st.integers(0, 2**32 - 1))
@settings(max_examples=100, deadline=None)
def test_they_accelerate_like_rotors_on_hinges(n: int, count: int, seed: int) -> None:
    """Of any mass, anywhere in the base."""
    robot, rotors, state, force = moving(n, count, seed)
    model = pinocchio_with_wheels(robot, rotors)
    expected = pinocchio_acceleration(model, model.createData(), state, force)
    found = accelerations(robot, rotors, state, force)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


@given(st.sampled_from([1, 6]), st.integers(1, MOST_WHEELS), st.integers(0, 2**32 - 1))
@settings(max_examples=30, deadline=None)
def test_they_accelerate_as_in_mujoco(n: int, count: int, seed: int) -> None:
    robot, rotors, state, force = moving(n, count, seed)
    expected = mujoco_acceleration(mujoco_with_wheels(robot, rotors), state, force)
    found = accelerations(robot, rotors, state, force)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-10 * np.abs(expected).max())
