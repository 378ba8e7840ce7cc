"""Jacobians of tools against Pinocchio with a base velocity that keeps the momenta at zero."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from random_trees import BASE, KINDS, random_bodies
from tree_oracle import TreeOracle, pinocchio_tree

from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.kinematics import (
    manipulability,
    reaction_null_space,
    tool_jacobian,
    tool_state,
)
from space_robot_msgs_py.errors import InputError

Array = np.ndarray


class ToolOracle(TreeOracle):
    """Pinocchio's motion of a tree with zero momenta, and of one of its tools."""

    def __init__(self, robot: Robot, bodies: list, tool: str, seed: int) -> None:
        super().__init__(pinocchio_tree(bodies), BASE, robot.all_joint_names, seed)
        name = tool.removeprefix("tool of ")
        frame = next(body for body in bodies if body.name == name).tools[0]
        carrier = self.model.frames[self.model.getFrameId(name, pin.FrameType.BODY)]
        at = carrier.placement * pin.SE3(frame.rotation, frame.position)
        self.tool = self.model.addFrame(
            pin.Frame(tool, carrier.parentJoint, at, pin.FrameType.OP_FRAME)
        )
        self.data = self.model.createData()
        pin.framesForwardKinematics(self.model, self.data, self.q)
        self.map = pin.computeCentroidalMap(self.model, self.data, self.q).copy()

    def jacobian_of(self, attitude: str) -> Array:
        """Twist of the tool by joint velocities: the base moves as the momenta ask for."""
        base, joints = self.map[:, :6], self.map[:, self.columns]
        if attitude == "held":  # Pinocchio's base velocity is linear first
            base, joints = base[:3, :3], joints[:3]
        velocity = np.zeros((self.model.nv, len(self.columns)))
        velocity[self.columns] = np.eye(len(self.columns))
        velocity[: len(base)] = -np.linalg.solve(base, joints)
        rows = pin.computeFrameJacobian(
            self.model, self.data, self.q, self.tool, pin.LOCAL_WORLD_ALIGNED
        )
        return rows @ velocity

    def pose(self) -> tuple[Array, Array]:
        place = self.data.oMf[self.tool]
        com = pin.centerOfMass(self.model, self.data, self.q)
        return place.rotation, place.translation - com


trees = st.tuples(
    st.lists(st.sampled_from(KINDS), min_size=1, max_size=8), st.integers(0, 2**31 - 1)
).filter(lambda tree: any(kind in ("revolute", "prismatic") for kind in tree[0]))


@given(trees)
@settings(deadline=None)
def test_jacobians_of_all_tools_are_pinocchios(tree: tuple[list[str], int]) -> None:
    kinds, seed = tree
    bodies = random_bodies(np.random.default_rng(seed), kinds)
    robot = Robot.of_tree("tree", bodies)
    for tool in robot.tools:
        oracle = ToolOracle(robot, bodies, tool.name, seed)
        posture = oracle.attitude(), oracle.positions
        state = tool_state(robot, *posture, tool.name)
        rotation, position = oracle.pose()
        np.testing.assert_allclose(state.rotation, rotation, rtol=0.0, atol=1e-12)
        np.testing.assert_allclose(state.position, position, rtol=0.0, atol=1e-11)
        for attitude in ("held", "free"):
            expected = oracle.jacobian_of(attitude)
            ours = tool_jacobian(robot, *posture, attitude, tool.name)
            scale = max(1.0, float(np.max(np.abs(expected))))
            np.testing.assert_allclose(ours, expected, rtol=0.0, atol=1e-12 * scale)
        coupling = oracle.map[3:, oracle.columns] - oracle.map[3:, :3] @ np.linalg.solve(
            oracle.map[:3, :3], oracle.map[:3, oracle.columns]
        )
        scale = max(1.0, float(np.max(np.abs(coupling))))
        np.testing.assert_allclose(state.coupling, coupling, rtol=0.0, atol=1e-11 * scale)


def test_base_columns_are_a_rigid_motion_of_the_whole() -> None:
    robot = find_robot("seven_joint")
    state = tool_state(robot, [1.0, 0.0, 0.0, 0.0], np.full(robot.joint_count, 0.3))
    omega = np.array([0.1, -0.2, 0.3])
    twist = state.attitude @ omega  # the whole turns about its centre of mass
    np.testing.assert_allclose(twist[:3], np.cross(omega, state.position), atol=1e-15)
    np.testing.assert_allclose(twist[3:], omega)


def test_reaction_null_space_leaves_angular_momentum_alone() -> None:
    robot = find_robot("seven_joint")
    posture = [1.0, 0.0, 0.0, 0.0], np.linspace(-1.0, 1.0, robot.joint_count)
    basis = reaction_null_space(robot, *posture)
    state = tool_state(robot, *posture)
    assert basis.shape == (7, 4)
    np.testing.assert_allclose(basis.T @ basis, np.eye(4), atol=1e-12)
    scale = float(np.max(np.abs(state.coupling)))
    np.testing.assert_allclose(state.coupling @ basis, 0.0, atol=1e-12 * scale)
    np.testing.assert_allclose(state.free @ basis, state.held @ basis, atol=1e-12)


def test_manipulability_is_the_product_of_the_singular_values() -> None:
    robot = find_robot("paper")
    jacobian = tool_jacobian(robot, [1.0, 0.0, 0.0, 0.0], np.full(6, 0.4), "free")
    expected = np.prod(np.linalg.svd(jacobian, compute_uv=False))
    assert manipulability(jacobian) == pytest.approx(expected, rel=1e-9)


def test_unknown_names_are_refused_in_one_line() -> None:
    robot = find_robot("paper")
    with pytest.raises(InputError, match="unknown attitude 'led'"):
        tool_jacobian(robot, [1.0, 0.0, 0.0, 0.0], np.zeros(6), "led")  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"'hand': choose one of .*; `tools: \[\.\.\.\]` in"):
        tool_state(robot, [1.0, 0.0, 0.0, 0.0], np.zeros(6), "hand")
