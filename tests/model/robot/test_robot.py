"""Robot files: what is read, what every error says, and a robot's own numbers as a file again."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from oracles import TreeOracle, assert_same_dynamics, pinocchio_tree
from paths import CONFIG, DATA
from scipy.spatial.transform import Rotation
from strategies import random_robot, random_robot_file, random_tree

from space_robot_model.robot import Robot
from space_robot_model.robot.files import readable_document
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.inertia import inertia_tensor
from space_robot_model.robot.parts import Base, Body, JointLimits, RobotTree
from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.errors import InputError

REFUSALS = yaml.safe_load((DATA / "refusals/robots.yaml").read_text("utf-8"))


@pytest.fixture
def content() -> dict[str, Any]:
    """A valid robot file of three joints."""
    return random_robot_file(np.random.default_rng(5), 3)


def write(folder: Path, content: Any) -> Path:
    path = folder / "arm.yaml"
    path.write_text(content if isinstance(content, str) else yaml.safe_dump(content))
    return path


def error_of(path: Path) -> str:
    """The one line that reading ``path`` ends with."""
    with pytest.raises(InputError) as caught:
        Robot.from_yaml(path)
    text = str(caught.value)
    assert text.startswith(f"{path}: ")
    assert "\n" not in text
    return text


def test_paper_robot_holds_tables_2_and_3(paper_robot: Robot) -> None:
    """Also the misprint: a_3 is -1.08 so that a_3 + b_3 = -d_4."""
    assert (paper_robot.name, paper_robot.n) == ("paper", 6)
    assert paper_robot.axis_names == ("base_x", "base_y", "base_z", *paper_robot.joint_names)
    np.testing.assert_array_equal(paper_robot.mass, [750, 20, 35, 20, 10, 20, 5])
    twists = Rotation.from_matrix(paper_robot.rotation).as_euler("xyz", degrees=True)
    np.testing.assert_allclose(np.abs(twists[:, 0]), [0, 90, 180, 90, 90, 90])
    np.testing.assert_array_equal(paper_robot.rotation[4, 2], [0, -1, 0])
    np.testing.assert_array_equal(paper_robot.offset[:, 0], [0.5, 0, 2.7, 0, 0, 0])
    np.testing.assert_array_equal(paper_robot.offset[:, 2], [1.05, 0, 0, 2.16, 0, 0.35])
    np.testing.assert_array_equal(paper_robot.com[3], [0, -1.08, 0])
    np.testing.assert_array_equal(paper_robot.inertia[6], np.diag([0.8, 0.4, 0.6]))
    np.testing.assert_array_equal(paper_robot.tool.position, [0.0, 0.0, 0.25])
    assert paper_robot.tool.body == 6


def test_from_yaml_reads_every_number(tmp_path: Path, content: dict[str, Any]) -> None:
    """Of a file with products of inertia, and of its tool."""
    content["robot"]["tool"] = {"alpha_deg": 180.0, "d": 0.3}
    robot = Robot.from_yaml(write(tmp_path, content))
    base, links = content["robot"]["base"], content["robot"]["links"]
    assert robot.joint_names == ("joint1", "joint2", "joint3")
    np.testing.assert_array_equal(robot.mass, [base["mass"], *(k["mass"] for k in links)])
    np.testing.assert_array_equal(robot.com, [[0, 0, 0], *(k["com"] for k in links)])
    twists = Rotation.from_euler("x", [[k["alpha_deg"]] for k in links], degrees=True)
    np.testing.assert_allclose(robot.rotation, twists.as_matrix(), rtol=0.0, atol=1e-15)
    for tensor, body in zip(robot.inertia, [base, *links], strict=True):
        xx, yy, zz, xy, xz, yz = body["inertia"]
        np.testing.assert_array_equal(tensor, [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    np.testing.assert_array_equal(robot.tool.rotation, np.diag([1.0, -1.0, -1.0]))
    np.testing.assert_array_equal(robot.tool.position, [0.0, 0.0, -0.3])


def test_the_base_is_seen_from_its_centre_of_mass(content: dict[str, Any]) -> None:
    """Also where a file gives it in another frame; a joint may have a name of its own."""
    before = Robot.from_dict(content)
    content["robot"]["base"]["com"] = [0.1, -0.2, 0.3]
    content["robot"]["links"][0]["joint_name"] = "shoulder"
    robot = Robot.from_dict(content)
    assert robot.joint_names == ("shoulder", "joint2", "joint3")
    assert not robot.com[0].any()
    moved = robot.rotation[0] @ (robot.offset[0] - before.offset[0])
    np.testing.assert_allclose(moved, [-0.1, 0.2, -0.3], atol=1e-15)


def test_model_is_exact_at_right_angles(paper_robot: Robot) -> None:
    """No 6e-17 where the cosine of 90 degrees is meant; any other twist as cos and sin say."""
    assert set(paper_robot.model.rotation[:6].ravel()) <= {-1.0, 0.0, 1.0}
    content = random_robot_file(np.random.default_rng(6), 4)
    twists = np.radians([link["alpha_deg"] for link in content["robot"]["links"]])
    rotation = Robot.from_dict(content).model.rotation
    np.testing.assert_array_equal(rotation[:4, 4], np.cos(twists))
    np.testing.assert_array_equal(rotation[:4, 7], np.sin(twists))


def test_triangle_inequality_admits_a_flat_plate(content: dict[str, Any]) -> None:
    """Izz = Ixx + Iyy holds with equality there, whatever axes it is given on."""
    axes = Rotation.from_euler("xyz", [0.3, 1.1, -0.7]).as_matrix()
    t = axes @ np.diag([1.0, 2.0, 3.0]) @ axes.T
    plate = [t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2]]
    content["robot"]["base"]["inertia"] = [float(value) for value in plate]
    assert Robot.from_dict(content).n == 3


SOME_KINDS = ("revolute", "prismatic", "fixed", "passive revolute", "passive prismatic", "revolute")


def same(one: Robot, other: Robot) -> None:
    for field in fields(Robot):
        if field.name in ("repairs", "source"):
            continue
        a, b = getattr(one, field.name), getattr(other, field.name)
        if isinstance(a, np.ndarray):
            assert a.tobytes() == b.tobytes(), field.name
        else:
            assert repr(a) == repr(b), field.name


@given(st.integers(0, 2**32 - 1))
def test_trees_come_back_to_the_bit(seed: int) -> None:
    tree = Robot.from_tree(random_tree(np.random.default_rng(seed), SOME_KINDS))
    for robot in (tree, tree.nominal, random_robot(np.random.default_rng(seed), 3)):
        content = json.loads(json.dumps(robot.content))
        again = Robot.from_dict(content)
        same(robot, again)
        assert again.model.tobytes() == robot.model.tobytes()
        assert again.content == robot.content


@pytest.mark.parametrize(
    ("key", "value", "said"), [("weight", 1.0, "weight: unknown key"), ("links", [], "links")]
)
def test_wrong_numbers_are_refused(paper_robot: Robot, key: str, value: Any, said: str) -> None:
    content = paper_robot.content
    content["robot"][key] = value
    with pytest.raises(InputError) as caught:
        Robot.from_dict(content)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_robot_file_made_of_a_robot_has_its_limits(paper_robot: Robot) -> None:
    limits = [
        JointLimits(-1.0, 2.0, 0.5, 30.0),
        JointLimits(),
        JointLimits(effort=7.0),
        JointLimits(velocity=0.25),
        *paper_robot.limits[4:],
    ]
    robot = replace(paper_robot, limits=tuple(limits))
    again = Robot.from_dict(json.loads(json.dumps(readable_document(robot.tree))))
    for before, after in zip(robot.limits, again.limits, strict=True):
        assert after == pytest.approx(before)


def test_shapes_are_part_of_the_numbers() -> None:
    """So drag and sunlight act on the same plates, whatever a robot is built from."""
    robot = Robot.from_urdf(DATA / "arm.urdf")
    assert {shape.shape for shape in robot.visuals} >= {"box", "cylinder", "sphere", "mesh"}
    exact = Robot.from_dict(json.loads(json.dumps(robot.content)))
    assert repr(exact.visuals) == repr(robot.visuals)
    written = Robot.from_dict(yaml.safe_load(yaml.safe_dump(readable_document(robot.tree))))
    for before, after in zip(robot.visuals, written.visuals, strict=True):
        assert (after.shape, after.body, after.size) == (before.shape, before.body, before.size)
        assert (after.mesh, after.colour) == (before.mesh, before.colour)
        np.testing.assert_allclose(after.rotation, before.rotation, atol=1e-15)
        np.testing.assert_allclose(after.position, before.position, atol=1e-15)


def edited(content: dict[str, Any], changes: dict[str, Any]) -> None:
    for path, value in changes.items():
        *way, last = ["robot", *filter(None, path.split("."))]
        place: Any = content
        for key in way:
            place = place[int(key) if key.isdigit() else key]
        if value is None:
            del place[last]
        else:
            place[last] = value


@pytest.mark.parametrize(("changes", "said"), REFUSALS["files"])
def test_error_names_file_key_given_and_allowed(
    changes: dict[str, Any], said: list[str], tmp_path: Path, content: dict[str, Any]
) -> None:
    edited(content, changes)
    text = error_of(write(tmp_path, content))
    assert all(part in text for part in said)


@pytest.mark.parametrize(("text", "said"), REFUSALS["texts"])
def test_error_says_where_a_file_is_no_yaml_mapping(
    text: str, said: list[str], tmp_path: Path
) -> None:
    message = error_of(write(tmp_path, text))
    assert all(part in message for part in said)


def chain_of(content: dict[str, Any]) -> RobotTree:
    """The chain that a file with origins tells of, its angles turned by SciPy."""
    links, parent, base = [], "base", content["base"]
    for link in content["links"]:
        turn = Rotation.from_euler("xyz", link["origin"].get("rpy_deg", [0.0] * 3), True)
        links.append(
            Body(
                name=link["name"],
                parent=parent,
                joint=link.get("joint", "revolute"),
                rotation=turn.as_matrix(),
                offset=turn.inv().apply(link["origin"]["xyz"]),
                axis=np.array(link.get("axis", [0, 0, 1]), float),
                mass=link["mass"],
                inertia=inertia_tensor(link["inertia"]),
                com=np.array(link["com"]),
            )
        )
        parent = link["name"]
    return RobotTree("chain", Base(base["mass"], inertia_tensor(base["inertia"])), links)


@pytest.mark.parametrize("name", ["canadarm", "canadarm2"])
def test_dynamics_are_pinocchios_of_the_same_file(name: str) -> None:
    robot, content = find_robot(name), read_yaml(CONFIG / f"robots/{name}.yaml")["robot"]
    oracle = TreeOracle(pinocchio_tree(chain_of(content)), "base", robot.all_joint_names, 1)
    assert_same_dynamics(robot, oracle, 1)
