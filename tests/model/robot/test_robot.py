"""Robot files: what is read, and what every error says."""

from __future__ import annotations

import copy
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from random_robots import random_robot_file
from scipy.spatial.transform import Rotation

from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError, SpaceRobotError

Edit = Callable[[dict[str, Any]], None]


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


def test_model_is_exact_at_right_angles(paper_robot: Robot) -> None:
    """No 6e-17 where the cosine of 90 degrees is meant; any other twist as cos and sin say."""
    assert set(paper_robot.model.rotation[:6].ravel()) <= {-1.0, 0.0, 1.0}
    content = random_robot_file(np.random.default_rng(6), 4)
    twists = np.radians([link["alpha_deg"] for link in content["robot"]["links"]])
    rotation = Robot.from_dict(content).model.rotation
    np.testing.assert_array_equal(rotation[:4, 4], np.cos(twists))
    np.testing.assert_array_equal(rotation[:4, 7], np.sin(twists))


def test_with_last_link_changes_that_link_only(paper_robot: Robot) -> None:
    loaded = paper_robot.with_last_link(10.0, [1.2, 0.6, 1.0, 0.1, 0.0, 0.0])
    np.testing.assert_array_equal(loaded.mass, [750, 20, 35, 20, 10, 20, 10])
    np.testing.assert_array_equal(loaded.inertia[6], [[1.2, 0.1, 0], [0.1, 0.6, 0], [0, 0, 1]])
    np.testing.assert_array_equal(loaded.inertia[:6], paper_robot.inertia[:6])
    np.testing.assert_array_equal(loaded.com, paper_robot.com)
    assert paper_robot.mass[6] == 5.0
    assert paper_robot.inertia[6, 0, 0] == 0.8


def test_triangle_inequality_admits_a_flat_plate(content: dict[str, Any]) -> None:
    """Izz = Ixx + Iyy holds with equality there, whatever axes it is given on."""
    axes = Rotation.from_euler("xyz", [0.3, 1.1, -0.7]).as_matrix()
    t = axes @ np.diag([1.0, 2.0, 3.0]) @ axes.T
    plate = [t[0, 0], t[1, 1], t[2, 2], t[0, 1], t[0, 2], t[1, 2]]
    content["robot"]["base"]["inertia"] = [float(value) for value in plate]
    assert Robot.from_dict(content).n == 3


def in_base(key: str, value: Any) -> Edit:
    return lambda content: content["robot"]["base"].__setitem__(key, value)


def in_link(index: int, key: str, value: Any) -> Edit:
    return lambda content: content["robot"]["links"][index].__setitem__(key, value)


def without(*keys: Any) -> Edit:
    def edit(content: dict[str, Any]) -> None:
        for key in keys[:-1]:
            content = content[key]
        del content[keys[-1]]

    return edit


FAULTS: dict[str, tuple[Edit, list[str]]] = {
    "negative mass": (in_base("mass", -3.0), ["robot.base.mass", "-3.0", "greater than 0"]),
    "massless link": (in_link(1, "mass", 0.0), ["robot.links.1.mass", "0.0", "greater than 0"]),
    "mass is text": (in_base("mass", "heavy"), ["robot.base.mass", "'heavy'", "number"]),
    "mass is NaN": (in_base("mass", float("nan")), ["robot.base.mass", "nan", "finite"]),
    "mass is infinite": (in_base("mass", float("inf")), ["robot.base.mass", "inf", "finite"]),
    "com has NaN": (in_link(0, "com", [0, float("nan"), 0]), ["robot.links.0.com.1", "nan"]),
    "indefinite inertia": (
        in_link(2, "inertia", [1.0, 1.0, 1.0, 2.0, 0.0, 0.0]),
        ["robot.links.2.inertia", "[1.0, 1.0, 1.0, 2.0, 0.0, 0.0]", "positive definite", "-1"],
    ),
    "triangle inequality": (
        in_base("inertia", [1.0, 1.0, 2.5, 0.0, 0.0, 0.0]),
        ["robot.base.inertia", "triangle inequality", "1, 1, 2.5"],
    ),
    "triangle inequality on turned axes": (
        in_base("inertia", [1.75, 1.75, 1.0, 0.75, 0.0, 0.0]),
        ["robot.base.inertia", "triangle inequality", "1, 1, 2.5"],
    ),
    "inertia too short": (
        in_base("inertia", [1.0, 1.0, 1.0]),
        ["robot.base.inertia", "at least 6", "[1.0, 1.0, 1.0]"],
    ),
    "com too long": (
        in_link(1, "com", [1.0, 2.0, 3.0, 4.0]),
        ["robot.links.1.com", "at most 3", "[1.0, 2.0, 3.0, 4.0]"],
    ),
    "unknown key": (
        in_link(0, "weight", 5.0),
        ["robot.links.0.weight", "5.0", "unknown key", "choose one of a, alpha_deg, axis, com, d"],
    ),
    "missing key": (without("robot", "links", 1, "mass"), ["robot.links.1.mass", "required"]),
    "no links": (
        lambda content: content["robot"].__setitem__("links", []),
        ["robot.links", "[]", "at least 1"],
    ),
    "no robot": (without("robot"), ["robot", "required"]),
    "duplicate names": (
        in_link(2, "name", "joint1"),
        ["robot.links", "must differ", "'joint1' occurs twice"],
    ),
    "name of a base axis": (in_link(0, "name", "base_y"), ["robot.links", "'base_y'"]),
    **{
        f"{name!r} means something else": (
            in_link(0, "name", name),
            ["robot.links", f"joint {name!r} needs another name: it is {meaning}"],
        )
        for name, meaning in {
            "*": "the pattern of all joints",
            "2": "the number of a joint",
            "all": "a group of axes",
            "base": "the name of the base",
            "time": "a column of trajectories",
            "base_torque_z": "a column of disturbances",
            "wheel_1": "the name of an actuator",
            "joint2_rate": "the column of the rate of 'joint2'",
        }.items()
    },
    "tool on no link": (
        lambda content: content["robot"].__setitem__("tool", {"link": "join6"}),
        ["robot.tool", "unknown link 'join6' of tool 0: choose one of base, joint1"],
    ),
    "one of several tools on no link": (
        lambda content: content["robot"].update(tool=None, tools=[{}, {"name": "b", "link": "c"}]),
        ["robot.tools", "unknown link 'c' of tool 1"],
    ),
    "tool and tools": (
        lambda content: content["robot"].update(tool={}, tools=[{"name": "camera"}]),
        ["robot.tools", "either tool or tools"],
    ),
    "two tools of a name": (
        lambda content: content["robot"].update(tool=None, tools=[{}, {"link": "joint2"}]),
        ["robot.tools", "tool names must differ, 'tool' occurs twice"],
    ),
    "empty name": (in_link(0, "name", ""), ["robot.links.0.name", "''", "at least 1"]),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_error_names_file_key_given_and_allowed(
    fault: str, tmp_path: Path, content: dict[str, Any]
) -> None:
    edit, expected = FAULTS[fault]
    faulty = copy.deepcopy(content)
    edit(faulty)
    text = error_of(write(tmp_path, faulty))
    for part in expected:
        assert part in text


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("robot: {name: ]\n", ["line 1", "not YAML"]),
        ("robot:\n  name: a\n base: 3\n", ["line 3", "not YAML"]),
        ("- 1\n- 2\n", ["a mapping was expected", "list"]),
        ("", ["a mapping was expected", "NoneType"]),
    ],
)
def test_error_says_where_a_file_is_no_yaml_mapping(
    text: str, expected: list[str], tmp_path: Path
) -> None:
    message = error_of(write(tmp_path, text))
    for part in expected:
        assert part in message


def test_error_names_a_missing_file_and_an_unreadable_one(tmp_path: Path) -> None:
    assert "no such file" in error_of(tmp_path / "none.yaml")
    assert "not a file" in error_of(tmp_path)
    binary = tmp_path / "binary.yaml"
    binary.write_bytes(b"\xff\xfe\xfa")
    assert "cannot be read" in error_of(binary)


def test_input_errors_are_project_errors_with_exit_code_2(tmp_path: Path) -> None:
    with pytest.raises(SpaceRobotError) as caught:
        Robot.from_yaml(tmp_path / "none.yaml")
    assert caught.value.exit_code == 2
    assert isinstance(caught.value, ValueError)
