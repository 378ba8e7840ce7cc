"""A robot's URDF text: read back it is the same robot, here and in Pinocchio, with tf's frames."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import TreeOracle, assert_close, assert_same_dynamics, quaternion_of
from paths import DATA
from scipy.spatial.transform import Rotation
from strategies import SEEDS, TREES, random_tree

from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import bias_force, mass_matrix
from space_robot_model.robot.find import find_robot, robot_names
from space_robot_model.robot.parts import Base, Body, JointLimits, RobotTree, Tool, Visual
from space_robot_model.robot.placements import frame_names, joint_transforms, tool_transforms
from space_robot_model.robot.shapes import shapes_of
from space_robot_model.robot.urdf_text import urdf_text
from space_robot_msgs_py.topics import INERTIAL_FRAME

ROBOTS = [*robot_names(), str(DATA / "arm.urdf")]


def limited_tree(seed: int, kinds: list[str]) -> Robot:
    """Any tree; limits of its joints are there in part."""
    rng = np.random.default_rng(seed)
    robot = Robot.from_tree(random_tree(rng, kinds))
    limits = [_random_limits(rng) for _ in range(robot.n)]
    return replace(robot, limits=tuple(limits))


def _random_limits(rng: np.random.Generator) -> JointLimits:
    values = rng.uniform((-3.0, 0.1, 0.1, 1.0), (0.0, 3.0, 2.0, 90.0))
    none = np.array([-np.inf, np.inf, np.inf, np.inf])
    return JointLimits(*map(float, np.where(rng.random(4) < 0.4, none, values)))


def read_back(robot: Robot) -> Robot:
    """What the reader makes of the text, with the springs and tools that URDF cannot tell."""
    passive: dict[str, Any] = {}
    for number, (name, spring) in enumerate(zip(robot.passive_names, robot.springs, strict=True)):
        slides = robot.is_prismatic[robot.n + number]
        passive[name] = {
            "stiffness": spring.stiffness,
            "damping": spring.damping,
            "rest_deg": spring.rest if slides else float(np.degrees(spring.rest)),
        }
    content = {
        "urdf_text": urdf_text(robot),
        "passive": passive,
        "tools": list(frame_names(robot).tools),
    }
    return Robot.from_dict({"robot": content})


def assert_same_robot(found: Robot, robot: Robot) -> None:
    """Its numbers; those of the joints' frames to rounding, for they went through angles."""
    assert found.name == robot.name
    assert found.joint_names == robot.joint_names
    assert found.passive_names == robot.passive_names
    assert found.body_names == frame_names(robot).bodies
    for exact in ("mass", "com", "parent", "is_prismatic"):
        np.testing.assert_array_equal(getattr(found, exact), getattr(robot, exact))
    for nearly in ("inertia", "rotation", "offset"):
        np.testing.assert_allclose(getattr(found, nearly), getattr(robot, nearly), 1e-14, 1e-14)
    assert found.limits == robot.limits
    np.testing.assert_array_equal(found.friction[: robot.n], robot.friction[: robot.n])
    np.testing.assert_allclose(found.springs, robot.springs, rtol=1e-15)
    assert found.order == robot.order
    for ours, tool in zip(found.tools, robot.tools, strict=True):
        assert ours.body == tool.body
        np.testing.assert_allclose(ours.rotation, tool.rotation, atol=1e-14)
        np.testing.assert_allclose(ours.position, tool.position, atol=1e-14)


def pinocchio_model(text: str) -> pin.Model:
    return pin.buildModelFromXML(text, pin.JointModelFreeFlyer())


def assert_frames_of_transforms(robot: Robot, oracle: TreeOracle) -> None:
    """Pinocchio's frames of the text's links are those that tf is told, to 1e-9."""
    pin.framesForwardKinematics(oracle.model, oracle.data, oracle.q)
    seen = {
        frame.name: oracle.data.oMf[number]
        for number, frame in enumerate(oracle.model.frames)
        if frame.type == pin.FrameType.BODY
    }
    transforms = joint_transforms(robot, oracle.positions[np.newaxis]) + tool_transforms(robot)
    names = frame_names(robot)
    assert set(seen) == {*names.bodies, *names.tools}
    assert [transform.child for transform in tool_transforms(robot)] == list(names.tools)
    for transform in transforms:
        between = seen[transform.parent].actInv(seen[transform.child])
        np.testing.assert_allclose(transform.position[0], between.translation, atol=1e-9)
        turn = quaternion_of(Rotation.from_matrix(between.rotation))
        given = transform.quaternion[0]
        np.testing.assert_allclose(given * np.sign(given @ turn), turn, atol=1e-9)


def assert_mujoco_moves_joints_alike(robot: Robot, model: mujoco.MjModel) -> None:
    """Of a base that stands, as MuJoCo's is: the joints' part of H and c."""
    model.opt.gravity[:] = 0.0
    data, rng = mujoco.MjData(model), np.random.default_rng(2)
    theta, rates = rng.uniform(-1.0, 1.0, (2, robot.joint_count))
    dofs = [model.joint(name).dofadr[0] for name in robot.all_joint_names]
    data.qpos[dofs], data.qvel[dofs] = theta, rates
    mujoco.mj_forward(model, data)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    upright, still = [1.0, 0.0, 0.0, 0.0], np.zeros(3)
    found, bias = (
        mass_matrix(robot, upright, theta)[6:, 6:],
        bias_force(robot, upright, theta, still, rates)[6:],
    )
    assert_close(inertia[np.ix_(dofs, dofs)], found, 1e-9)
    assert_close(data.qfrc_bias[dofs], bias, 1e-9)


@settings(max_examples=40)
@given(seed=SEEDS, kinds=TREES)
def test_random_trees(seed: int, kinds: list[str]) -> None:
    """Branches, prismatic and passive joints, tools on all bodies, limits in part."""
    robot = limited_tree(seed, kinds)
    assert_same_robot(read_back(robot), robot)
    oracle = TreeOracle(
        pinocchio_model(urdf_text(robot)), frame_names(robot).bodies[0], robot.all_joint_names, seed
    )
    assert_same_dynamics(robot, oracle, seed)
    assert_frames_of_transforms(robot, oracle)


@pytest.mark.parametrize("name", ROBOTS, ids=lambda name: Path(name).stem)
def test_shipped_robots(name: str) -> None:
    """Those of DH numbers, of origins, of a URDF; MuJoCo reads them, too."""
    robot = find_robot(name)
    assert_same_robot(read_back(robot), robot)
    text = urdf_text(robot)
    assert text == urdf_text(find_robot(name)), "the same for the same robot"
    oracle = TreeOracle(
        pinocchio_model(text), frame_names(robot).bodies[0], robot.all_joint_names, 1
    )
    assert_same_dynamics(robot, oracle, 1)
    assert_frames_of_transforms(robot, oracle)
    model = mujoco.MjModel.from_xml_string(text)
    assert {model.joint(i).name for i in range(model.njnt)} == set(robot.all_joint_names)
    masses = [model.body(name).mass[0] for name in frame_names(robot).bodies[1:]]
    np.testing.assert_allclose(masses, robot.mass[1:], rtol=1e-15)
    assert_mujoco_moves_joints_alike(robot, model)


@pytest.mark.parametrize("name", ROBOTS, ids=lambda name: Path(name).stem)
def test_shapes(name: str, tmp_path: Path) -> None:
    """The file's own or those drawn, with place, size, colour and mesh."""
    robot = find_robot(name)
    file = tmp_path / "robot.urdf"
    file.write_text(urdf_text(robot))
    found = Robot.from_urdf(file)
    expected = sorted(shapes_of(robot), key=lambda shape: shape.body)
    assert len(found.visuals) == len(expected) > 0
    for shape, given_shape in zip(found.visuals, expected, strict=True):
        assert (shape.shape, shape.size, shape.mesh, shape.colour) == (
            given_shape.shape,
            given_shape.size,
            given_shape.mesh,
            given_shape.colour,
        )
        assert found.body_names[shape.body] == frame_names(robot).bodies[given_shape.body]
        np.testing.assert_allclose(shape.position, given_shape.position, atol=1e-14)
        np.testing.assert_allclose(shape.rotation, given_shape.rotation, atol=1e-14)


def link_of(name: str, parent: str, joint: str) -> Body:
    return Body(
        name=name, parent=parent, joint_name=joint, mass=2.0, inertia=np.eye(3), com=np.zeros(3)
    )


def flown_robot(base: str, link: str, tool: str, visuals: Sequence[Visual] = ()) -> Robot:
    """A base and a link on a joint called as it is."""
    tools = [Tool(tool, position=np.ones(3), link=link), Tool(tool, link=link)]
    hull, own = Base(9.0, np.eye(3), name=base), [replace(visual, link=link) for visual in visuals]
    return Robot.from_tree(
        RobotTree("two", hull, [link_of(link, base, link)], tools=tools, visuals=own)
    )


NAMES = st.sampled_from(
    [
        "base",
        "base_link",
        "joint1",
        "link1",
        "link1_body",
        "tool",
        "tool_joint",
        "a",
        "a_link",
        INERTIAL_FRAME,
        "/a\nb",
        "a_b",
        "--",
        "<&\"'",
    ]
)


@given(
    bodies=st.lists(NAMES, min_size=3, max_size=3, unique=True),
    joints=st.lists(NAMES.filter(lambda name: name != "base"), min_size=2, max_size=2, unique=True),
    tools=st.lists(NAMES, min_size=3, max_size=3),
)
def test_every_name_of_a_urdf_is_there_once(
    bodies: list[str], joints: list[str], tools: list[str]
) -> None:
    """Among links, among joints, and among both; tf knows the same links; others can read it."""
    base, *names = bodies
    links = [link_of(*own) for own in zip(names, bodies, joints, strict=False)]
    frames = [
        Tool(tool, position=np.ones(3), link=name) for tool, name in zip(tools, bodies, strict=True)
    ]
    robot = Robot.from_tree(
        RobotTree("three", Base(2.0, np.eye(3), name=base), links, tools=frames)
    )
    text, names = urdf_text(robot), frame_names(robot)
    root = ElementTree.fromstring(text)
    links, fixed = ([e.attrib["name"] for e in root.iter(tag)] for tag in ("link", "joint"))
    assert sorted(links) == sorted([*names.bodies, *names.tools])
    assert len({*links, *fixed}) == 6 + 5
    assert INERTIAL_FRAME not in links
    moving = {e.attrib["name"] for e in root.iter("joint") if e.attrib["type"] != "fixed"}
    assert {name for name in joints if name.isidentifier()} <= moving, "joints keep their names"
    assert pinocchio_model(text).njoints == 4


@pytest.mark.parametrize(
    ("body", "joint", "link"),
    [
        ("joint1", "joint1", "link1"),
        ("LeftJoint_2", "LeftJoint_2", "LeftLink_2"),
        ("elbow", "elbow", "elbow_link"),
        ("arm", "shoulder", "arm"),
        ("link1", "joint1", "link1"),
    ],
)
@pytest.mark.parametrize(("base", "root"), [("base", "base_link"), ("hull", "hull")])
def test_frames_are_named_as_ros_does(
    body: str, joint: str, link: str, base: str, root: str
) -> None:
    hull, tool = Base(2.0, np.eye(3), name=base), Tool(body, position=np.ones(3), link=body)
    robot = Robot.from_tree(RobotTree("two", hull, [link_of(body, base, joint)], tools=[tool]))
    names = frame_names(robot)
    assert names.bodies == (root, link)
    assert names.tools == (f"{body}_tool",)


def test_meshes_are_told_by_addresses(tmp_path: Path) -> None:
    mesh = tmp_path / "a plate.stl"
    shapes = tuple(
        Visual("mesh", (1.0, 2.0, 0.5), np.eye(3), np.zeros(3), mesh=name)
        for name in (str(mesh), "package://gone/b.dae")
    )
    text = urdf_text(flown_robot("base", "wrist", "tool", visuals=shapes))
    meshes = [element.attrib for element in ElementTree.fromstring(text).iter("mesh")]
    assert meshes == [
        {"filename": f"file://{tmp_path}/a%20plate.stl", "scale": "1 2 0.5"},
        {"filename": "package://gone/b.dae", "scale": "1 2 0.5"},
    ]
    found = Robot.from_dict({"robot": {"urdf_text": text}})
    assert [shape.mesh for shape in found.visuals] == [str(mesh), "package://gone/b.dae"]
