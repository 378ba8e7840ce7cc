"""Momentum of whole flights against Pinocchio's, and what any momentum must fulfil."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from conservation import momentum
from hypothesis import given
from hypothesis import strategies as st
from oracles import pinocchio_model, pinocchio_state, rotation_of
from random_robots import random_robot, random_state

from space_robot_model.robot import Robot
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_msgs_py.samples import RobotState

SEEDS = st.integers(0, 2**32 - 1)


def motion_of(states: list) -> Motion:
    """Random states as a flight; their velocities are on inertial axes, a flight's in the base."""
    omega = [rotation_of(state.quaternion).as_matrix().T @ state.w0 for state in states]
    return Motion(
        np.array([state.quaternion for state in states]),
        np.array(omega),
        np.array([state.theta for state in states]),
        np.array([state.rate for state in states]),
    )


@given(SEEDS, st.integers(1, 8))
def test_it_is_pinocchios_centroidal_momentum(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    robot, states = random_robot(rng, n), [random_state(rng, n) for _ in range(3)]
    model = pinocchio_model(robot)
    data, found = model.createData(), robot_momentum(robot, motion_of(states))
    for k, state in enumerate(states):
        wanted = pin.computeCentroidalMomentum(model, data, *pinocchio_state(state)).angular
        size = np.linalg.norm(wanted) + np.linalg.norm(state.velocity)
        np.testing.assert_allclose(found.angular[k], wanted, rtol=0.0, atol=1e-12 * size * 1e3)
        np.testing.assert_allclose(found.centre_of_mass[k], data.com[0], rtol=1e-11, atol=1e-12)


def test_of_a_rigid_body_it_is_inertia_times_rate(paper_robot: Robot) -> None:
    """An arm that stands in one posture: the momentum is linear in the rate, and symmetric."""
    rows, theta = 3, np.array([0.3, -0.8, 1.1, 0.2, -0.5, 0.9])
    still = Motion(
        np.tile([1.0, 0.0, 0.0, 0.0], (rows, 1)),
        np.eye(3),
        np.tile(theta, (rows, 1)),
        np.zeros((rows, 6)),
    )
    inertia = robot_momentum(paper_robot, still).angular
    np.testing.assert_allclose(inertia, inertia.T, atol=1e-10)
    assert np.linalg.eigvalsh(inertia).min() > 0.0
    base = robot_momentum(paper_robot, still).base
    np.testing.assert_allclose(base, base.T, atol=1e-10)
    lever = robot_momentum(paper_robot, still).centre_of_mass[0]
    alone = paper_robot.inertia[0] + paper_robot.mass[0] * (
        lever @ lever * np.eye(3) - np.outer(lever, lever)
    )
    np.testing.assert_allclose(base, alone, rtol=1e-12, atol=1e-10)
    faster = robot_momentum(paper_robot, still._replace(omega_base=2.0 * np.eye(3))).angular
    np.testing.assert_allclose(faster, 2.0 * inertia, rtol=1e-13)


def test_it_is_that_of_a_single_state(paper_robot: Robot) -> None:
    """The plant's own momentum is about the inertial origin: less what its CoM carries."""
    rng = np.random.default_rng(3)
    state = random_state(rng, 6)
    motion = motion_of([state])
    single = RobotState.allocate(6)
    single.quaternion[:], single.omega_base[:] = state.quaternion, motion.omega_base[0]
    single.joint_positions[:], single.joint_velocities[:] = state.theta, state.rate
    single.base_position[:], single.base_velocity[:] = rng.normal(size=3), state.v0
    found = robot_momentum(paper_robot, motion)
    linear, angular = momentum(paper_robot, single)
    about_com = angular - np.cross(single.base_position + found.centre_of_mass[0], linear)
    np.testing.assert_allclose(found.angular[0], about_com, rtol=1e-10, atol=1e-9)


def test_wrong_shapes_are_named(paper_robot: Robot) -> None:
    still = Motion(np.zeros((2, 4)), np.zeros((2, 3)), np.zeros((2, 6)), np.zeros((2, 5)))
    with pytest.raises(ValueError, match=r"joint_velocities: shape \(2, 6\)"):
        robot_momentum(paper_robot, still)
