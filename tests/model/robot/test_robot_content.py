"""A robot's own numbers as a mapping: through text and back to the bit, whatever built it."""

from __future__ import annotations

import json
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from paths import DATA
from random_robots import random_robot
from random_trees import random_bodies

from space_robot_model.robot import Robot
from space_robot_model.robot.source import document_of
from space_robot_model.robot.tree.bodies import JointLimits
from space_robot_msgs_py.errors import InputError

KINDS = ("revolute", "prismatic", "fixed", "passive revolute", "passive prismatic", "revolute")


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
    bodies = [  # the tools in another order than their bodies
        replace(body, tools=tuple(replace(tool, rank=-number) for tool in body.tools))
        for number, body in enumerate(random_bodies(np.random.default_rng(seed), KINDS))
    ]
    tree = Robot.of_tree("tree", bodies)
    for robot in (tree, tree.nominal, random_robot(np.random.default_rng(seed), 3)):
        content = json.loads(json.dumps(robot.content))
        again = Robot.from_dict(content)
        same(robot, again)
        assert again.model.tobytes() == robot.model.tobytes()
        assert again.content == robot.content


def test_the_shipped_robot(paper_robot: Robot) -> None:
    same(paper_robot, Robot.from_dict(paper_robot.content))


@pytest.mark.parametrize(
    ("key", "value", "said"), [("weight", 1.0, "weight: unknown key"), ("bodies", [], "bodies")]
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
    again = Robot.from_dict(json.loads(json.dumps(document_of(robot))))
    for before, after in zip(robot.limits, again.limits, strict=True):
        assert after == pytest.approx(before)


def test_shapes_are_part_of_the_numbers() -> None:
    """So drag and sunlight act on the same plates, whatever a robot is built from."""
    robot = Robot.from_urdf(DATA / "arm.urdf")
    assert {shape.shape for shape in robot.visuals} >= {"box", "cylinder", "sphere", "mesh"}
    exact = Robot.from_dict(json.loads(json.dumps(robot.content)))
    assert repr(exact.visuals) == repr(robot.visuals)
    written = Robot.from_dict(yaml.safe_load(yaml.safe_dump(document_of(robot))))
    for before, after in zip(robot.visuals, written.visuals, strict=True):
        assert (after.shape, after.body, after.size) == (before.shape, before.body, before.size)
        assert (after.mesh, after.colour) == (before.mesh, before.colour)
        np.testing.assert_allclose(after.rotation, before.rotation, atol=1e-15)
        np.testing.assert_allclose(after.position, before.position, atol=1e-15)


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        ({"shape": "box", "size": [1.0, 1.0]}, "size of a box: 3 numbers above 0 were expected"),
        ({"shape": "sphere", "size": [0.0]}, "size of a sphere: 1 numbers above 0"),
        ({"shape": "mesh", "size": [1, 1, 1], "mesh": "a.stl"}, "mesh: an absolute path or a URL"),
        ({"shape": "sphere", "size": [1.0], "mesh": "/a.stl"}, "of a mesh only"),
        ({"shape": "sphere", "size": [1.0], "link": "leg"}, "unknown link 'leg' of visual 0"),
    ],
)
def test_wrong_shapes_are_refused(paper_robot: Robot, shape: dict[str, Any], said: str) -> None:
    content = document_of(paper_robot)
    content["robot"]["visuals"] = [shape]
    with pytest.raises(InputError, match=said):
        Robot.from_dict(content)
