"""The frames of a tree's bodies, tick by tick, are Pinocchio's."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from hypothesis import given
from hypothesis import strategies as st
from oracles import rotation_of
from random_robots import random_quaternion
from random_trees import BASE, KINDS, random_bodies
from tree_oracle import TreeOracle, pinocchio_tree

from space_robot_model.robot import Robot
from space_robot_model.robot.base_axes import base_axes
from space_robot_model.robot.frames import body_frames


@given(seed=st.integers(0, 2**32 - 2), kinds=st.lists(st.sampled_from(KINDS), max_size=11))
def test_tools_and_joint_axes_are_where_pinocchio_has_them(seed: int, kinds: list[str]) -> None:
    """The tool of every body, merged ones too, in three postures at once."""
    rng = np.random.default_rng(seed)
    bodies = random_bodies(rng, ["revolute", *kinds])
    robot, model = Robot.of_tree("tree", bodies), pinocchio_tree(bodies)
    oracle = TreeOracle(model, BASE, robot.all_joint_names, seed)
    quaternion = np.array([random_quaternion(rng) for _ in range(3)]).T
    theta = rng.uniform(-3.0, 3.0, (robot.joint_count, 3))
    x, y, z = base_axes(quaternion)
    frames = {frame.body: frame for frame in body_frames(robot, (x, y, z), theta)}
    assert sorted(frames) == list(range(robot.joint_count + 1))
    places = {tool.name: tool for tool in robot.tools}
    for k in range(3):
        step = np.zeros(model.nv)
        step[oracle.columns] = theta[:, k]
        q = pin.integrate(model, pin.neutral(model), step)
        q[3:7] = rotation_of(quaternion[:, k]).as_quat()
        pin.framesForwardKinematics(model, oracle.data, q)
        com = oracle.data.oMf[oracle.frame].translation
        for body in bodies:
            own, tool = body.tools[0], places[body.tools[0].name]
            frame = frames[tool.body]
            frame_id = model.getFrameId(body.name, pin.FrameType.BODY)
            there = oracle.data.oMf[frame_id] * pin.SE3(own.rotation, own.position)
            here = (frame.origin + frame.on_outer_axes(tool.position))[:, k]
            np.testing.assert_allclose(here, there.translation - com, atol=1e-12)
            axes = np.array([frame.x[:, k], frame.y[:, k], frame.z[:, k]]).T
            np.testing.assert_allclose(axes @ tool.rotation, there.rotation, atol=1e-13)
            if body.joint and body.joint.kind != "fixed":
                axis = oracle.data.oMf[frame_id].rotation @ body.joint.axis
                np.testing.assert_allclose(frame.z[:, k], axis, atol=1e-13)
