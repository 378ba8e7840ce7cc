"""The robot's shapes as markers: poses are Pinocchio's, messages are those of rosbags and rclpy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import rotation_of
from random_robots import random_quaternion
from random_trees import KINDS, random_bodies
from scipy.spatial.transform import Rotation

from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.markers import RobotMarkers
from space_robot_model.robot.poses import RobotPoses
from space_robot_model.robot.shapes import LINK_COLOUR, shapes_of
from space_robot_model.robot.tree import Visual
from space_robot_model.robot.urdf_text import urdf_text
from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.topics import INERTIAL_FRAME
from space_robot_msgs_py.wire.definitions import decode
from space_robot_msgs_py.wire.markers import no_markers

Array = NDArray[np.float64]
TIMEBASE = Timebase(500_000)
SEEDS = st.integers(0, 2**32 - 2)


def random_state(robot: Robot, rng: np.random.Generator) -> RobotState:
    state = RobotState.allocate(robot.n)
    state.tick = int(rng.integers(2_000_000))
    state.base_position[:] = rng.normal(size=3)
    state.quaternion[:] = random_quaternion(rng)
    state.joint_positions[:] = rng.uniform(-2.0, 2.0, robot.n)
    passive = len(robot.passive_names)
    state.passive_positions[:passive] = rng.uniform(-0.3, 0.3, passive)
    return state


def pinocchio_shapes(robot: Robot, state: RobotState) -> list[pin.SE3]:
    """Where Pinocchio has the shapes of the robot's URDF text, in the order of `shapes_of`."""
    text = urdf_text(robot)
    model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    geometry = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.VISUAL)
    joints = np.append(state.joint_positions, state.passive_positions)
    q = pin.neutral(model)
    q[:3], q[3:7] = state.base_position, state.quaternion[[1, 2, 3, 0]]
    for number, name in enumerate(robot.all_joint_names):
        joint, position = model.joints[model.getJointId(name)], joints[number]
        is_continuous = joint.nq == 2
        q[joint.idx_q : joint.idx_q + joint.nq] = (
            [np.cos(position), np.sin(position)] if is_continuous else [position]
        )
    data, shapes = model.createData(), geometry.createData()
    pin.updateGeometryPlacements(model, data, geometry, shapes, q)
    found: dict[str, list[pin.SE3]] = {}
    for number, shape in enumerate(geometry.geometryObjects):
        link = model.frames[shape.parentFrame].name
        found.setdefault(link, []).append(shapes.oMg[number])
    return [found[robot.body_names[shape.body]].pop(0) for shape in shapes_of(robot)]


@settings(max_examples=25)
@given(seed=SEEDS, kinds=st.lists(st.sampled_from(KINDS), max_size=9))
def test_poses_are_pinocchios(seed: int, kinds: list[str]) -> None:
    """Decoded from the message, to 1e-9."""
    rng = np.random.default_rng(seed)
    robot = Robot.of_tree("tree", random_bodies(rng, ["revolute", *kinds]))
    state = random_state(robot, rng)
    data = RobotMarkers(robot, TIMEBASE).encode(state.tick, RobotPoses(robot).at(state))
    message = decode(data, topics.MARKERS.type)
    expected = pinocchio_shapes(robot, state)
    for marker, placed in zip(message.markers, expected, strict=True):
        p, o = marker.pose.position, marker.pose.orientation
        np.testing.assert_allclose([p.x, p.y, p.z], placed.translation, atol=1e-9)
        turn = Rotation.from_quat([o.x, o.y, o.z, o.w]).as_matrix()
        np.testing.assert_allclose(turn, placed.rotation, atol=1e-9)
        stamp = marker.header.stamp.sec * 1_000_000_000 + marker.header.stamp.nanosec
        assert stamp == TIMEBASE.stamp_ns(state.tick)
        assert marker.header.frame_id == INERTIAL_FRAME


SHAPES = (
    Visual("box", (1.0, 2.0, 3.0), np.eye(3), np.zeros(3), colour=(0.1, 0.2, 0.3, 0.4)),
    Visual("sphere", (0.5,), np.eye(3), np.ones(3), body=1),
    Visual("cylinder", (0.25, 2.0), np.eye(3), np.zeros(3), body=1),
    Visual("mesh", (1.0, 1.0, 2.0), np.eye(3), np.zeros(3), mesh="/a b.stl", body=1),
    Visual(
        "mesh",
        (1.0, 1.0, 1.0),
        np.eye(3),
        np.zeros(3),
        mesh="package://a/b.dae",
        colour=(1.0, 0.0, 0.0, 1.0),
        body=2,
    ),
)


def test_fields() -> None:
    """Names, numbers, sizes and colours, which stay; rclpy reads the message as rosbags does."""
    robot = replace(find_robot("paper"), visuals=SHAPES)
    markers = RobotMarkers(robot, TIMEBASE, prefix="sat1/")
    state = random_state(robot, np.random.default_rng(1))
    poses = RobotPoses(robot)
    data = markers.encode(state.tick, poses.at(state))
    found = decode(data, topics.MARKERS.type).markers
    names = [(marker.ns, marker.id) for marker in found]
    assert names == [
        ("sat1/base_link", 0),
        ("sat1/link1", 0),
        ("sat1/link1", 1),
        ("sat1/link1", 2),
        ("sat1/link2", 0),
    ]
    assert [marker.type for marker in found] == [1, 2, 3, 10, 10]
    sizes = [[marker.scale.x, marker.scale.y, marker.scale.z] for marker in found]
    assert sizes == [[1, 2, 3], [1, 1, 1], [0.5, 0.5, 2], [1, 1, 2], [1, 1, 1]]
    colours = [[getattr(marker.color, key) for key in "rgba"] for marker in found]
    expected = [(0.1, 0.2, 0.3, 0.4), LINK_COLOUR, LINK_COLOUR, (1, 1, 1, 1), (1, 0, 0, 1)]
    np.testing.assert_allclose(colours, expected, rtol=1e-6)
    assert [marker.mesh_resource for marker in found[3:]] == ["file:///a%20b.stl", SHAPES[4].mesh]
    assert [marker.mesh_use_embedded_materials for marker in found] == [0, 0, 0, 1, 0]
    assert {marker.action for marker in found} == {0}
    other = random_state(robot, np.random.default_rng(2))
    again = decode(markers.encode(other.tick, poses.at(other)), topics.MARKERS.type)
    assert [(marker.ns, marker.id) for marker in again.markers] == names
    moved = np.array([again.markers[0].pose.position.x, found[0].pose.position.x])
    assert moved[0] != moved[1]
    (cleared,) = decode(no_markers(), topics.MARKERS.type).markers
    assert cleared.action == 3


def test_rclpy_reads_it() -> None:
    serialization = pytest.importorskip("rclpy.serialization")
    messages = pytest.importorskip("visualization_msgs.msg")
    robot = replace(find_robot("paper"), visuals=SHAPES)
    state = random_state(robot, np.random.default_rng(1))
    markers = RobotMarkers(robot, TIMEBASE)
    poses = RobotPoses(robot).at(state)
    data = markers.encode(state.tick, poses)
    message = serialization.deserialize_message(data, messages.MarkerArray)
    position, orientation = np.split(markers.poses(poses)[3], [3])
    marker = message.markers[3]
    p, o = marker.pose.position, marker.pose.orientation
    assert ([p.x, p.y, p.z], [o.x, o.y, o.z, o.w]) == (position.tolist(), orientation.tolist())
    assert (marker.type, marker.ADD, marker.ns) == (marker.MESH_RESOURCE, marker.action, "link1")
    turn = rotation_of(state.quaternion)
    base = message.markers[0].pose.orientation
    np.testing.assert_allclose(
        Rotation.from_quat([base.x, base.y, base.z, base.w]).as_matrix(),
        turn.as_matrix(),
        atol=1e-14,
    )
    assert serialization.deserialize_message(no_markers(), messages.MarkerArray).markers
