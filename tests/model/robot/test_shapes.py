"""Shapes drawn from kinematics and masses: they have the bodies' inertia, and reach the joints."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_robots import random_inertia
from random_trees import random_bodies, random_rotation

from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot, robot_names
from space_robot_model.robot.inertia import inertia_tensor
from space_robot_model.robot.shapes import (
    BASE_COLOUR,
    JOINT_COLOUR,
    LINK_COLOUR,
    PANEL_COLOUR,
    even_box,
    shapes_of,
)
from space_robot_model.robot.tree import Visual


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


@given(st.integers(0, 2**32 - 1))
def test_tubes_lead_from_a_joint_to_the_next_ones_and_to_the_tools(seed: int) -> None:
    rng = np.random.default_rng(seed)
    robot = Robot.of_tree("tree", random_bodies(rng, ["revolute", "prismatic", "revolute"]))
    ends: list[tuple[int, np.ndarray]] = [(tool.body, tool.position) for tool in robot.tools]
    for joint, parent in enumerate(robot.parent):
        ends.append((int(parent), robot.rotation[joint] @ robot.offset[joint]))
    tubes = [s for s in shapes_of(robot) if s.shape == "cylinder"]
    for body, end in ends:
        if body == 0:
            continue  # from where it leaves the box
        reached = [
            np.allclose(np.sort([0.0, np.linalg.norm(end)]), _reach(tube, end))
            for tube in tubes
            if tube.body == body
        ]
        assert any(reached)


def _reach(tube: Visual, towards: np.ndarray) -> np.ndarray:
    """Where a tube begins and ends along a direction; NaN if it does not lie along it."""
    along = towards / np.linalg.norm(towards)
    axis = tube.rotation[:, 2]
    if not np.isclose(abs(axis @ along), 1.0) or not np.allclose(
        np.cross(tube.position, along), 0.0, atol=1e-9
    ):
        return np.full(2, np.nan)
    half = 0.5 * tube.size[1]
    middle = tube.position @ along
    return np.array([middle - half, middle + half])


def test_what_slides_out_is_still_joined_to_where_it_came_from() -> None:
    robot = find_robot("boom")
    for joint in np.flatnonzero(robot.is_prismatic[: robot.n]):
        tubes = [s for s in shapes_of(robot) if s.body == joint + 1 and s.shape == "cylinder"]
        back = min(t.position[2] - 0.5 * t.size[1] * abs(t.rotation[2, 2]) for t in tubes)
        assert back == pytest.approx(-robot.limits[joint].upper)


def test_what_a_file_tells_is_drawn_instead(paper_robot: Robot) -> None:
    told = (Visual("sphere", (0.4,), np.eye(3), np.zeros(3), body=2),)
    assert shapes_of(replace(paper_robot, visuals=told)) == told
