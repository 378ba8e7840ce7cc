"""Shapes of robots: drawn from their masses, as markers, and in their URDF text."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation
from strategies import (
    KINDS,
    SEEDS,
    random_bodies,
    random_inertia,
    random_quaternion,
    random_rotation,
)

from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot, robot_names
from space_robot_model.robot.inertia import inertia_tensor
from space_robot_model.robot.markers import RobotMarkers
from space_robot_model.robot.poses import RobotPoses
from space_robot_model.robot.shapes import (
    BASE_COLOUR,
    JOINT_COLOUR,
    LINK_COLOUR,
    PANEL_COLOUR,
    even_box,
    shapes_of,
)
from space_robot_model.robot.tree import Visual
from space_robot_model.robot.urdf_text import urdf_text
from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.topics import INERTIAL_FRAME
from space_robot_msgs_py.wire.definitions import decode
from space_robot_msgs_py.wire.markers import no_markers


@given(st.integers(0, 2**32 - 1), st.floats(0.5, 500.0))
def test_an_even_box_has_mass_centre_and_inertia(seed: int, mass: float) -> None:
    rng = np.random.default_rng(seed)
    turn, com = random_rotation(rng), rng.normal(size=3)
    inertia = turn @ inertia_tensor(random_inertia(rng, mass)) @ turn.T
    box = even_box(mass, inertia, com, 3, BASE_COLOUR)
    x, y, z = np.square(box.size)
    own = mass / 12.0 * np.diag([y + z, x + z, x + y])
    found = box.rotation @ own @ box.rotation.T
    np.testing.assert_allclose(found, inertia, atol=1e-9 * np.max(inertia) + mass * 0.02**2)
    assert np.linalg.det(box.rotation) == pytest.approx(1.0)
    np.testing.assert_array_equal(box.position, com)
    assert box.body == 3


@pytest.mark.parametrize("name", robot_names())
def test_every_body_of_a_shipped_robot_is_drawn(name: str) -> None:
    robot = find_robot(name)
    shapes = shapes_of(robot)
    assert {shape.body for shape in shapes} == set(range(robot.joint_count + 1))
    assert all(0.0 <= part <= 1.0 for shape in shapes for part in shape.colour)
    panels = {robot.n + 1 + k for k in range(len(robot.springs))}
    assert {s.body for s in shapes if s.shape == "box"} == {0, *panels}
    base, panel = BASE_COLOUR, PANEL_COLOUR
    assert all(s.colour == (panel if s.body else base) for s in shapes if s.shape == "box")
    assert len({BASE_COLOUR, PANEL_COLOUR, LINK_COLOUR, JOINT_COLOUR}) == 4


def test_what_a_file_tells_is_drawn_instead(paper_robot: Robot) -> None:
    told = (Visual("sphere", (0.4,), np.eye(3), np.zeros(3), body=2),)
    assert shapes_of(replace(paper_robot, visuals=told)) == told


TIMEBASE = Timebase(500_000)


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
