"""Inertia, momentum and fastest motion of robots with gears, from rotors that are bodies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from geared_robots import oscillator, random_gears, with_gears
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import rotation_of
from random_robots import random_quaternion, random_robot, random_state
from random_trees import random_bodies
from rotor_equations import RotorEquations
from rotor_oracles import pinocchio_momentum, random_motor_rotors

from space_robot_model.robot import Robot
from space_robot_model.robot.frames import body_frames
from space_robot_model.robot.gears import flexible_model, geared_joints, motor_momentum, rotor_rows
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.tree import Gear

Array = NDArray[np.float64]

KINDS = ("revolute", "passive revolute", "prismatic", "revolute", "fixed", "passive prismatic")
SEEDS = st.integers(0, 2**32 - 1)


def tree(seed: int) -> tuple[Robot, np.random.Generator]:
    rng = np.random.default_rng(seed)
    return random_gears(rng, Robot.of_tree("tree", random_bodies(rng, KINDS))), rng


@given(SEEDS)
@settings(max_examples=40)
def test_couplings_of_rotors_are_those_of_the_inertia_matrix(seed: int) -> None:
    """In any attitude and posture; and all of it at rest upright."""
    robot, rng = tree(seed)
    equations, n = RotorEquations(robot, random_motor_rotors(rng, robot)), robot.joint_count
    quaternion, theta = random_quaternion(rng), rng.uniform(-3.0, 3.0, n)
    expected, _ = equations.matrices(quaternion, theta, np.zeros(equations.size))
    upright, _ = equations.matrices(np.eye(4)[0], theta, np.zeros(equations.size))
    size = 1e-12 * np.abs(expected).max()
    model = flexible_model(robot, theta)
    np.testing.assert_allclose(model.inertia, upright, rtol=0.0, atol=size)
    axes = rotation_of(quaternion).as_matrix().T[:, :, np.newaxis]
    frames = body_frames(robot, (axes[0], axes[1], axes[2]), theta[:, np.newaxis])
    rows, reflected = rotor_rows(robot, {frame.body: frame for frame in frames})
    np.testing.assert_allclose(
        rows, expected[6 + n :, : 6 + n], rtol=0.0, atol=1e-12 * np.abs(rows).max()
    )
    np.testing.assert_allclose(
        np.diag(reflected), expected[6 + n :, 6 + n :], rtol=0.0, atol=1e-12 * reflected.max()
    )


@given(SEEDS)
@settings(max_examples=30)
def test_robot_and_motors_have_the_momentum_of_all_bodies(seed: int) -> None:
    """By Pinocchio, about the common centre of mass."""
    robot, rng = tree(seed)
    rotors, state = random_motor_rotors(rng, robot), random_state(rng, robot.joint_count)
    speeds = 10.0 * rng.normal(size=len(rotors))
    _, expected = pinocchio_momentum(robot, rotors, state, speeds)
    quaternion, theta = state.quaternion[None], state.theta[None]
    omega = rotation_of(state.quaternion).inv().apply(state.w0)
    motion = Motion(quaternion, omega[None], theta, state.rate[None])
    motors = motor_momentum(robot, quaternion, theta, speeds[None])
    actual = (robot_momentum(robot, motion).angular + motors)[0]
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("damping", [0.0, 0.4, 1e4])
def test_the_fastest_motion_is_the_two_masses(damping: float) -> None:
    """Absolute roots of ``s^2 + (1/B + 1/I) (D s + K)``."""
    gear, link = Gear(2e-5, 100.0, 150.0, damping), 0.5
    lighter = 1.0 / gear.reflected_inertia + 1.0 / link
    roots = np.roots([1.0, lighter * damping, lighter * gear.stiffness])
    fastest = flexible_model(oscillator(gear, link), np.zeros(1)).fastest
    assert fastest == pytest.approx(np.abs(roots).max(), rel=1e-9)


def test_stiffness_stands_between_joint_and_motor() -> None:
    rng = np.random.default_rng(3)
    robot = with_gears(
        random_robot(rng, 3), [Gear(1e-3, 10.0, 7.0, 2.0), None, Gear(1e-3, 5.0, 9.0)]
    )
    assert geared_joints(robot) == [0, 2]
    model, stretch = flexible_model(robot, np.zeros(3)), np.zeros((2, 11))
    stretch[0, [6, 9]] = stretch[1, [8, 10]] = -1.0, 1.0
    for matrix, values in ((model.stiffness, [7.0, 9.0]), (model.damping, [2.0, 0.0])):
        np.testing.assert_array_equal(matrix, stretch.T @ np.diag(values) @ stretch)


def test_a_rigid_robot_has_no_motors() -> None:
    robot = replace(random_robot(np.random.default_rng(0), 3), gears=())
    assert geared_joints(robot) == []
    spin = motor_momentum(robot, np.eye(4)[:1], np.zeros((1, 3)), np.zeros((1, 0)))
    np.testing.assert_array_equal(spin, np.zeros((1, 3)))
    assert flexible_model(robot, np.zeros(3)).fastest == 0.0
