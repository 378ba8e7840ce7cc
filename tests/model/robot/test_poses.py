"""Frames, tools, their Jacobians, and shapes are where Pinocchio has them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import ToolOracle, TreeOracle, assert_close, pinocchio_tree, rotation_of
from scipy.spatial.transform import Rotation
from strategies import (
    BASE,
    SEEDS,
    TREES,
    random_inertia,
    random_quaternion,
    random_rotation,
    random_tree,
)

from space_robot_model.elementary.matrices import Array
from space_robot_model.elementary.rotations import quaternion_of_rotation
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot, robot_names
from space_robot_model.robot.inertia import inertia_tensor
from space_robot_model.robot.kinematics import tool_state
from space_robot_model.robot.markers import RobotMarkers
from space_robot_model.robot.parts import Visual
from space_robot_model.robot.placements import (
    RobotPoses,
    base_axes,
    body_frames,
    frame_names,
    joint_transforms,
    tool_pose,
    tool_poses,
    tool_transforms,
)
from space_robot_model.robot.shapes import BASE_COLOUR, LINK_COLOUR, even_box, shapes_of
from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotState, Timebase
from space_robot_msgs_py.topics import INERTIAL_FRAME
from space_robot_msgs_py.wire.definitions import decode
from space_robot_msgs_py.wire.viewers import no_markers

UPRIGHT = [1.0, 0.0, 0.0, 0.0]


def placed(oracle: TreeOracle, quaternion: Array, theta: Array) -> dict[str, pin.SE3]:
    """Pinocchio's frames by their names, the base's CoM at the origin."""
    model, data, step = oracle.model, oracle.data, np.zeros(oracle.model.nv)
    step[oracle.columns] = theta
    q = pin.integrate(model, pin.neutral(model), step)
    q[3:7] = rotation_of(quaternion).as_quat()
    pin.framesForwardKinematics(model, data, q)
    com = data.oMf[oracle.frame].translation
    return {
        frame.name: pin.SE3(place.rotation, place.translation - com)
        for frame, place in zip(model.frames, data.oMf, strict=True)
    }


def assert_same_place(here: pin.SE3, there: pin.SE3) -> None:
    np.testing.assert_allclose(here.homogeneous, there.homogeneous, atol=1e-11)


@settings(max_examples=60)
@given(seed=SEEDS, kinds=TREES)
def test_bodies_and_tools_are_where_pinocchio_has_them(seed: int, kinds: list[str]) -> None:
    """For a state of a flight, for tf, and for all ticks of a log; merged bodies too."""
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, kinds)
    robot, ticks = Robot.from_tree(tree), 3
    oracle = TreeOracle(pinocchio_tree(tree), BASE, robot.all_joint_names, seed)
    quaternion = np.array([random_quaternion(rng) for _ in range(ticks)])
    theta = rng.uniform(-4.0, 4.0, (ticks, robot.joint_count))
    frames = {f.body: f for f in body_frames(robot, base_axes(quaternion.T), theta.T)}
    transforms = joint_transforms(robot, theta)
    rotation, position = tool_pose(robot, quaternion, theta)
    poses, state = RobotPoses(robot), RobotState.allocate(robot.n)
    tool_frames, on_bodies = tool_poses(robot)
    assert sorted(frames) == list(range(robot.joint_count + 1))
    assert [(t.parent, t.child) for t in transforms] == list(poses.frames[1:])
    for k in range(ticks):
        there = placed(oracle, quaternion[k], theta[k])
        passive = robot.joint_count - robot.n
        state.joint_positions[:], state.passive_positions[:passive] = np.split(theta[k], [robot.n])
        state.base_position[:], state.quaternion[:] = rng.normal(size=3), quaternion[k]
        where = {INERTIAL_FRAME: pin.SE3(np.eye(3), -state.base_position)}
        for (parent, child), pose in zip(poses.frames, poses.at(state), strict=True):
            where[child] = where[parent] * pin.XYZQUATToSE3(pose)
        by_tf = {transforms[0].parent: where[transforms[0].parent]} if transforms else {}
        for t in transforms:
            at, turn = (part[min(k, len(part) - 1)] for part in (t.position, t.quaternion))
            by_tf[t.child] = by_tf[t.parent] * pin.SE3(rotation_of(turn).as_matrix(), at)
        for name, body in zip(frame_names(robot).bodies, robot.body_names, strict=True):
            assert_same_place(by_tf[name], where[name])
            for link in (own for own in tree.links if own.name == body and own.moves):
                frame = frames[robot.body_names.index(body)]
                axis = there[body].rotation @ link.axis
                np.testing.assert_allclose(frame.z[:, k], axis, atol=1e-13)
        own = {tool.name: (tool.link, tool) for tool in tree.tools}
        for tool, (parent, _), pose in zip(robot.tools, tool_frames, on_bodies, strict=True):
            name, local = own[tool.name]
            expected = there[name] * pin.SE3(local.rotation, local.position)
            frame = frames[tool.body]
            axes = np.array([frame.x[:, k], frame.y[:, k], frame.z[:, k]]).T
            origin = (frame.origin + frame.on_outer_axes(tool.position))[:, k]
            assert_same_place(pin.SE3(axes @ tool.rotation, origin), expected)
            assert_same_place(where[parent] * pin.XYZQUATToSE3(pose), expected)
            if tool is robot.tool:
                assert_same_place(pin.SE3(rotation[k], position[k]), expected)
    for tool, link in zip(robot.tools, tool_transforms(robot), strict=True):
        assert link.child == frame_names(robot).tools[robot.tools.index(tool)]
        np.testing.assert_array_equal(link.position, [tool.position])
        turn = rotation_of(link.quaternion[0]).as_matrix()
        np.testing.assert_allclose(turn, tool.rotation, atol=1e-15)


@given(SEEDS)
def test_quaternions_are_scipys(seed: int) -> None:
    """Half turns, where a plain formula divides by zero, among them."""
    turn = random_rotation(np.random.default_rng(seed))
    found, there = quaternion_of_rotation(turn), Rotation.from_matrix(turn).as_quat()[[3, 0, 1, 2]]
    np.testing.assert_allclose(found * np.sign(found @ there), there, atol=1e-15)


def test_of_many_ticks_each_tool_is_that_of_its_own(paper_robot: Robot) -> None:
    rng = np.random.default_rng(3)
    quaternion = np.array([random_quaternion(rng) for _ in range(10_000)])
    theta = rng.uniform(-np.pi, np.pi, (10_000, 6))
    rotation, position = tool_pose(paper_robot, quaternion, theta)
    for k in (0, 8191, 8192, 9_999):
        alone = tool_pose(paper_robot, quaternion[k : k + 1], theta[k : k + 1])
        np.testing.assert_array_equal(rotation[k], alone[0][0])
        np.testing.assert_array_equal(position[k], alone[1][0])


@settings(max_examples=50)
@given(TREES, st.integers(0, 2**31 - 1))
def test_jacobians_of_all_tools_are_pinocchios_at_zero_momentum(
    kinds: list[str], seed: int
) -> None:
    tree = random_tree(np.random.default_rng(seed), kinds)
    robot = Robot.from_tree(tree)
    for tool in robot.tools:
        oracle = ToolOracle(robot, tree, tool.name, seed)
        posture = oracle.attitude(), oracle.positions
        state, place = tool_state(robot, *posture, tool.name), oracle.data.oMf[oracle.tool]
        com = pin.centerOfMass(oracle.model, oracle.data, oracle.q)
        assert_same_place(pin.SE3(state.rotation, state.position + com), place)
        for attitude in ("held", "free"):
            ours = robot.tool_jacobian(*posture[::-1], attitude, tool.name)
            assert_close(ours, oracle.jacobian_of(attitude), 1e-11)
        of_base, of_joints = oracle.map[:, :3], oracle.map[:, oracle.columns]
        coupling = of_joints[3:] - of_base[3:] @ np.linalg.solve(of_base[:3], of_joints[:3])
        assert_close(state.coupling, coupling, 1e-10)


def test_the_base_moves_the_whole_as_a_rigid_body_and_a_null_space_does_not_move_it() -> None:
    robot = find_robot("seven_joint")
    posture = UPRIGHT, np.linspace(-1.0, 1.0, robot.joint_count)
    state, omega = tool_state(robot, *posture), np.array([0.1, -0.2, 0.3])
    twist = state.attitude @ omega  # the whole turns about its centre of mass
    np.testing.assert_allclose(twist[:3], np.cross(omega, state.position), atol=1e-14)
    np.testing.assert_allclose(twist[3:], omega)
    basis = robot.reaction_null_space(*posture[::-1])
    assert basis.shape == (7, 4)
    np.testing.assert_allclose(basis.T @ basis, np.eye(4), atol=1e-12)
    scale = float(np.max(np.abs(state.coupling)))
    np.testing.assert_allclose(state.coupling @ basis, 0.0, atol=1e-12 * scale)
    np.testing.assert_allclose(state.free @ basis, state.held @ basis, atol=1e-12)


def test_unknown_names_are_refused_in_one_line() -> None:
    robot = find_robot("paper")
    with pytest.raises(InputError, match="unknown attitude 'led'"):
        robot.tool_jacobian(np.zeros(6), UPRIGHT, "led")  # type: ignore[arg-type]
    with pytest.raises(InputError, match=r"'hand': choose one of .*; `tools: \[\.\.\.\]` in"):
        tool_state(robot, UPRIGHT, np.zeros(6), "hand")


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


def test_what_a_file_tells_is_drawn_instead(paper_robot: Robot) -> None:
    told = (Visual("sphere", (0.4,), np.eye(3), np.zeros(3), body=2),)
    assert shapes_of(replace(paper_robot, visuals=told)) == told


TIMEBASE = Timebase(500_000)


def random_state(robot: Robot, rng: np.random.Generator) -> RobotState:
    state, passive = RobotState.allocate(robot.n), len(robot.passive_names)
    state.tick = int(rng.integers(2_000_000))
    state.base_position[:], state.quaternion[:] = rng.normal(size=3), random_quaternion(rng)
    state.joint_positions[:] = rng.uniform(-2.0, 2.0, robot.n)
    state.passive_positions[:passive] = rng.uniform(-0.3, 0.3, passive)
    return state


@settings(max_examples=25)
@given(seed=SEEDS, kinds=TREES)
def test_markers_are_where_their_bodies_have_them(seed: int, kinds: list[str]) -> None:
    """Decoded from the message, to 1e-9; the bodies' poses are Pinocchio's, as shown above."""
    rng = np.random.default_rng(seed)
    robot = Robot.from_tree(random_tree(rng, kinds))
    state, poses = random_state(robot, rng), RobotPoses(robot)
    found, where = poses.at(state), {INERTIAL_FRAME: pin.SE3.Identity()}
    for (parent, child), pose in zip(poses.frames, found, strict=True):
        where[child] = where[parent] * pin.XYZQUATToSE3(pose)
    places = [where[name] for name in frame_names(robot).bodies]
    data = RobotMarkers(robot, TIMEBASE).encode(state.tick, found)
    message = decode(data, topics.MARKERS.type)
    for marker, shape in zip(message.markers, shapes_of(robot), strict=True):
        expected = places[shape.body] * pin.SE3(shape.rotation, shape.position)
        p, o = marker.pose.position, marker.pose.orientation
        pose = pin.XYZQUATToSE3(np.array([p.x, p.y, p.z, o.x, o.y, o.z, o.w]))
        np.testing.assert_allclose(pose.homogeneous, expected.homogeneous, atol=1e-9)
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
    (cleared,) = decode(no_markers(), topics.MARKERS.type).markers
    assert cleared.action == 3
