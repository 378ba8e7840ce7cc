"""The poses that /tf tells, put together along the tree, are those of Pinocchio."""

from __future__ import annotations

import itertools

import numpy as np
import pinocchio as pin
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import rotation_of
from random_robots import random_quaternion
from random_trees import BASE, KINDS, random_bodies
from tree_oracle import TreeOracle, pinocchio_tree

from space_robot_model.robot import Robot
from space_robot_model.robot.poses import RobotPoses, tool_poses
from space_robot_msgs_py.samples import RobotState
from space_robot_msgs_py.topics import INERTIAL_FRAME

Array = NDArray[np.float64]


def placement(pose: Array) -> pin.SE3:
    return pin.XYZQUATToSE3(pose)


@given(seed=st.integers(0, 2**32 - 2), kinds=st.lists(st.sampled_from(KINDS), max_size=9))
def test_tools_are_where_pinocchio_has_them(seed: int, kinds: list[str]) -> None:
    """By every joint, prismatic and passive ones too; one state after the other."""
    rng = np.random.default_rng(seed)
    bodies = random_bodies(rng, ["revolute", *kinds])
    robot, model = Robot.of_tree("tree", bodies), pinocchio_tree(bodies)
    oracle, poses = TreeOracle(model, BASE, robot.all_joint_names, seed), RobotPoses(robot)
    state, passive = RobotState.allocate(robot.n), robot.joint_count - robot.n
    tool_frames, on_bodies = tool_poses(robot)
    for _ in range(2):
        theta = rng.uniform(-4.0, 4.0, robot.joint_count)
        state.joint_positions[:], state.passive_positions[:passive] = (
            theta[: robot.n],
            theta[robot.n :],
        )
        state.base_position[:], state.quaternion[:] = rng.normal(size=3), random_quaternion(rng)
        where = {INERTIAL_FRAME: pin.SE3.Identity()}
        for (parent, child), pose in zip(poses.frames, poses.at(state), strict=True):
            where[child] = where[parent] * placement(pose)
        step = np.zeros(model.nv)
        step[oracle.columns] = theta
        q = pin.integrate(model, pin.neutral(model), step)
        q[3:7] = rotation_of(state.quaternion).as_quat()
        pin.framesForwardKinematics(model, oracle.data, q)
        shift = state.base_position - oracle.data.oMf[oracle.frame].translation
        for tool, (parent, _), pose in zip(robot.tools, tool_frames, on_bodies, strict=True):
            (body,) = (body for body in bodies if body.tools[0].name == tool.name)
            own = body.tools[0]
            frame = oracle.data.oMf[model.getFrameId(body.name, pin.FrameType.BODY)]
            there, here = (
                frame * pin.SE3(own.rotation, own.position),
                where[parent] * placement(pose),
            )
            np.testing.assert_allclose(here.translation, there.translation + shift, atol=1e-11)
            np.testing.assert_allclose(here.rotation, there.rotation, atol=1e-12)


def test_frames_are_a_chain_from_the_inertial_one(paper_robot: Robot) -> None:
    frames = RobotPoses(paper_robot).frames
    names = [INERTIAL_FRAME, "base_link", *(f"link{i}" for i in range(1, 7))]
    assert list(frames) == list(itertools.pairwise(names))
    assert tool_poses(paper_robot)[0] == (("link6", "tool"),)
