"""The end effector's pose against Pinocchio, and what any pose must fulfil."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import pinocchio_model, rotation_of
from random_robots import random_quaternion, random_robot

from space_robot_model.robot import Robot
from space_robot_model.robot.tool import tool_pose


def pinocchio_tool(robot: Robot, quaternion: np.ndarray, theta: np.ndarray) -> pin.SE3:
    """The tool's frame in the inertial one, the base's CoM at its origin."""
    model = pinocchio_model(robot)
    data = model.createData()
    pin.forwardKinematics(
        model, data, np.concatenate([np.zeros(3), np.roll(quaternion, -1), theta])
    )
    return data.oMi[model.njoints - 1] * pin.SE3(robot.tool.rotation, robot.tool.position)


@given(st.integers(1, 9), st.integers(0, 2**32 - 1))
def test_the_pose_is_pinocchios(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = random_robot(rng, n)
    quaternion = np.array([random_quaternion(rng) for _ in range(3)])
    theta = rng.uniform(-np.pi, np.pi, (3, n))
    rotation, position = tool_pose(robot, quaternion, theta)
    for k in range(3):
        expected = pinocchio_tool(robot, quaternion[k], theta[k])
        np.testing.assert_allclose(rotation[k], expected.rotation, atol=1e-12)
        np.testing.assert_allclose(position[k], expected.translation, atol=1e-11)


@given(st.integers(0, 2**32 - 1))
def test_turning_the_base_turns_the_tool(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot, turn = random_robot(rng, 4), random_quaternion(rng)
    theta = rng.uniform(-np.pi, np.pi, (1, 4))
    rotation, position = tool_pose(robot, np.array([[1.0, 0.0, 0.0, 0.0]]), theta)
    turned_rotation, turned_position = tool_pose(robot, turn[np.newaxis], theta)
    matrix = rotation_of(turn).as_matrix()
    np.testing.assert_allclose(turned_rotation[0], matrix @ rotation[0], atol=1e-12)
    np.testing.assert_allclose(turned_position[0], matrix @ position[0], atol=1e-11)


def test_of_many_ticks_each_is_that_of_its_own(paper_robot: Robot) -> None:
    rng = np.random.default_rng(3)
    quaternion = np.array([random_quaternion(rng) for _ in range(20_000)])
    theta = rng.uniform(-np.pi, np.pi, (20_000, 6))
    rotation, position = tool_pose(paper_robot, quaternion, theta)
    for k in (0, 8191, 8192, 19_999):
        alone = tool_pose(paper_robot, quaternion[k : k + 1], theta[k : k + 1])
        np.testing.assert_array_equal(rotation[k], alone[0][0])
        np.testing.assert_array_equal(position[k], alone[1][0])


def test_wrong_shapes_are_named(paper_robot: Robot) -> None:
    with pytest.raises(ValueError, match=r"\(N, 6\).*\(2, 5\)"):
        tool_pose(paper_robot, np.ones((2, 4)), np.ones((2, 5)))
