"""Transforms tick by tick are those of a running flight, and their quaternions SciPy's."""

from __future__ import annotations

import numpy as np
import pytest
from random_trees import KINDS, random_bodies, random_rotation
from scipy.spatial.transform import Rotation

from space_robot_model.robot import Robot
from space_robot_model.robot.frame_names import frame_names
from space_robot_model.robot.poses import RobotPoses
from space_robot_model.robot.transforms import joint_transforms, tool_transforms, wxyz
from space_robot_msgs_py.samples import RobotState


@pytest.mark.parametrize("seed", range(20))
def test_every_tick_is_that_of_a_running_flight(seed: int) -> None:
    """`RobotPoses`, which Pinocchio agrees with, of one tick after the other."""
    rng = np.random.default_rng(seed)
    robot = Robot.of_tree("tree", random_bodies(rng, ["revolute", *rng.choice(KINDS, 8).tolist()]))
    theta = rng.uniform(-4.0, 4.0, (5, robot.joint_count))
    found, poses, state = (
        joint_transforms(robot, theta),
        RobotPoses(robot),
        RobotState.allocate(robot.n),
    )
    assert [(t.parent, t.child) for t in found] == list(poses.frames[1:])
    for k in range(5):
        state.joint_positions[:] = theta[k, : robot.n]
        state.passive_positions[: robot.joint_count - robot.n] = theta[k, robot.n :]
        told = poses.at(state)[1:]
        for transform, pose in zip(found, told, strict=True):
            position, quaternion = (
                part[min(k, len(part) - 1)] for part in (transform.position, transform.quaternion)
            )
            np.testing.assert_allclose(position, pose[:3], atol=1e-14)
            np.testing.assert_allclose(quaternion[[1, 2, 3, 0]], pose[3:], atol=1e-14)


def test_what_does_not_change_is_told_once(paper_robot: Robot) -> None:
    for transform in joint_transforms(paper_robot, np.zeros((7, 6))):
        assert transform.position.shape == (1, 3)
        assert transform.quaternion.shape == (7, 4)
    (tool,) = tool_transforms(paper_robot)
    assert tool.child == frame_names(paper_robot).tools[0]
    assert tool.position.shape == (1, 3)
    assert tool.quaternion.shape == (1, 4)


@pytest.mark.parametrize("seed", range(200))
def test_quaternions_are_scipys(seed: int) -> None:
    """Half turns, where a plain formula divides by zero, among them."""
    turn = random_rotation(np.random.default_rng(seed))
    found, there = wxyz(turn), Rotation.from_matrix(turn).as_quat()[[3, 0, 1, 2]]
    np.testing.assert_allclose(found * np.sign(found @ there), there, atol=1e-15)
