"""The chain of transforms against Pinocchio's frames, for trees of all kinds of joints."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from hypothesis import given
from hypothesis import strategies as st
from oracles import rotation_of
from random_trees import KINDS, random_bodies
from tree_oracle import pinocchio_tree

from space_robot_model.robot import Robot
from space_robot_model.robot.frame_names import frame_names
from space_robot_model.robot.transforms import joint_transforms, tool_transforms, wxyz

kinds = st.lists(st.sampled_from(KINDS), max_size=8).map(lambda some: ["revolute", *some])


def frames_of(model: pin.Model, positions: dict[str, float]) -> dict[str, pin.SE3]:
    """Pinocchio's frames by their names, the base at the origin."""
    data, q = model.createData(), pin.neutral(model)
    for name, position in positions.items():
        q[model.joints[model.getJointId(name)].idx_q] = position
    pin.framesForwardKinematics(model, data, q)
    return {frame.name: data.oMf[i] for i, frame in enumerate(model.frames)}


@given(kinds, st.integers(0, 2**32 - 1))
def test_composed_they_are_pinocchios_frames(kinds: list[str], seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = Robot.of_tree("tree", random_bodies(rng, kinds))
    model = pinocchio_tree(robot.bodies())
    angles = rng.uniform(-3.0, 3.0, (2, robot.joint_count))
    for k in range(2):
        expected = frames_of(model, dict(zip(robot.all_joint_names, angles[k], strict=True)))
        names = dict(zip(frame_names(robot).bodies, robot.body_names, strict=True))
        found = {robot.body_names[0]: pin.SE3.Identity()}
        for link in joint_transforms(robot, angles):
            place, turn = (
                link.position[k % len(link.position)],
                link.quaternion[k % len(link.quaternion)],
            )
            parent, child = names[link.parent], names[link.child]
            found[child] = found[parent] * pin.SE3(rotation_of(turn).as_matrix(), place)
        for name, pose in found.items():
            np.testing.assert_allclose(pose.homogeneous, expected[name].homogeneous, atol=1e-12)
        assert set(found) == set(robot.body_names)
        for tool, link in zip(robot.tools, tool_transforms(robot), strict=True):
            assert (names[link.parent], link.child) == (robot.body_names[tool.body], tool.name)
            np.testing.assert_array_equal(link.position, [tool.position])
            turn = rotation_of(link.quaternion[0]).as_matrix()
            np.testing.assert_allclose(turn, tool.rotation, atol=1e-15)


def test_what_does_not_change_stands_there_once(paper_robot: Robot) -> None:
    for link in joint_transforms(paper_robot, np.zeros((5, paper_robot.joint_count))):
        assert (link.position.shape, link.quaternion.shape) == ((1, 3), (5, 4))


def test_a_quaternion_begins_with_w() -> None:
    np.testing.assert_allclose(wxyz(np.diag([-1.0, -1.0, 1.0])), [0.0, 0.0, 0.0, 1.0], atol=1e-15)
    np.testing.assert_allclose(wxyz(np.eye(3)), [1.0, 0.0, 0.0, 0.0], atol=1e-15)
