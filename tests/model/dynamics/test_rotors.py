"""Rotors of geared joints against bodies of their own in Pinocchio."""

from __future__ import annotations

import numpy as np
from geared_robots import mounted, random_gears
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from random_robots import State, random_robot, random_state
from random_trees import random_bodies
from rotor_oracles import pinocchio_rotor_accelerations, random_motor_rotors, turns
from wheel_oracles import Rotor

from space_robot_model.dynamics.aba import aba
from space_robot_model.dynamics.kinematics import forward_kinematics, spatial_velocities
from space_robot_model.dynamics.model import Data
from space_robot_model.robot import Robot
from space_robot_model.robot.gears import geared_joints

Array = NDArray[np.float64]
SEEDS = st.integers(0, 2**32 - 1)
KINDS = (
    "revolute",
    "passive revolute",
    "prismatic",
    "revolute",
    "fixed",
    "revolute",
    "passive prismatic",
    "prismatic",
    "revolute",
)


class MovingRotors:
    """A robot with gears in motion, and a force on every coordinate."""

    def __init__(self, robot: Robot, rng: np.random.Generator) -> None:
        self.robot = robot
        self.rotors: list[Rotor] = random_motor_rotors(rng, robot)
        self.count, n = len(self.rotors), robot.joint_count
        self.state: State = random_state(rng, n)
        self.scale = turns(robot)
        self.motor_velocities = 100.0 * rng.normal(size=self.count) / self.scale[6 + n :]
        self.force = rng.normal(size=6 + n + self.count) * self.scale
        self.locked = np.zeros(n + self.count, dtype=bool)

    def accelerations(self) -> tuple[Array, Array]:
        """Return accelerations and holding torques by the plant's algorithm, robot's order."""
        robot, model, n = self.robot, mounted(self.robot), self.robot.joint_count
        rows = [*range(n, n + self.count)]
        rows = [*model.row[:n].astype(int), *rows]
        data, state = Data.allocate(robot.n), self.state
        velocities, force = np.empty(n + self.count), np.empty(6 + n + self.count)
        velocities[rows] = np.concatenate([state.rate, self.motor_velocities])
        force[:6], force[6:][rows] = self.force[:6], self.force[6:]
        positions, out = np.empty(n), np.empty(force.size)
        positions[rows[:n]] = state.theta
        forward_kinematics(model, state.quaternion, positions, data)
        spatial_velocities(model, state.w0, velocities, data)
        data.locked[rows] = self.locked
        aba(model, state.w0, velocities, force, data, out)
        return np.concatenate([out[:6], out[6:][rows]]), data.holding[rows]


def chain(n: int, seed: int) -> MovingRotors:
    rng = np.random.default_rng(seed)
    return MovingRotors(random_gears(rng, random_robot(rng, n)), rng)


def tree(seed: int) -> MovingRotors:
    """With joints that slide, passive and fixed ones, in any order of bodies."""
    rng = np.random.default_rng(seed)
    return MovingRotors(random_gears(rng, Robot.of_tree("tree", random_bodies(rng, KINDS))), rng)


def assert_as_in_pinocchio(moving: MovingRotors, tolerance: float) -> None:
    """Accelerations of everything, the rotors' own; relative to the largest."""
    arguments = moving.robot, moving.rotors, moving.state, moving.motor_velocities
    expected = pinocchio_rotor_accelerations(*arguments, moving.force) * moving.scale
    actual = moving.accelerations()[0] * moving.scale
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=tolerance * np.abs(expected).max())


@given(st.sampled_from([1, 2, 3, 6, 7]), SEEDS)
@settings(max_examples=100)
def test_chains_accelerate_like_bodies_with_rotors_on_them(n: int, seed: int) -> None:
    assert_as_in_pinocchio(chain(n, seed), 1e-12)


@given(SEEDS)
@settings(max_examples=100)
def test_trees_accelerate_like_bodies_with_rotors_on_them(seed: int) -> None:
    assert_as_in_pinocchio(tree(seed), 1e-11)


@given(SEEDS)
@settings(max_examples=50)
def test_locked_joints_and_rotors_stand_and_their_brakes_hold(seed: int) -> None:
    """With the brakes' torques as forces on everything free, Pinocchio accelerates all the same."""
    moving = tree(seed)
    free = moving.accelerations()[0] * moving.scale
    moving.locked[:] = np.random.default_rng(seed).random(moving.locked.size) < 0.4
    actual, holding = moving.accelerations()
    assert not actual[6:][moving.locked].any()
    moving.force[6:] -= np.where(moving.locked, holding, 0.0)
    arguments = moving.robot, moving.rotors, moving.state, moving.motor_velocities
    expected = pinocchio_rotor_accelerations(*arguments, moving.force) * moving.scale
    size = np.abs(free).max() + np.abs(expected).max()
    np.testing.assert_allclose(actual * moving.scale, expected, rtol=0.0, atol=1e-11 * size)


def test_the_examples_have_rotors_everywhere() -> None:
    """On the base and on links, on joints that turn and that slide, one and several on a body."""
    robots = [tree(seed).robot for seed in range(20)]
    pairs = {
        (robot.parent[joint] == 0, bool(robot.is_prismatic[joint]))
        for robot in robots
        for joint in geared_joints(robot)
    }
    assert len(pairs) == 4
    carriers = [robot.parent[geared_joints(robot)].tolist() for robot in robots]
    assert any(len(set(parents)) < len(parents) for parents in carriers)
