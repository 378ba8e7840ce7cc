"""The look-alikes of the two Canadarms: their files' numbers, read by Pinocchio, and sources."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from paths import CONFIG
from tree_oracle import TreeOracle, assert_same_dynamics

from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.kinematics import tool_state
from space_robot_msgs_py.config.validation import read_yaml

Array = np.ndarray
UPRIGHT = [1.0, 0.0, 0.0, 0.0]
NAMES = ("canadarm", "canadarm2")


def content(name: str) -> dict[str, Any]:
    robot: dict[str, Any] = read_yaml(CONFIG / f"robots/{name}.yaml")["robot"]
    return robot


def inertia_matrix(numbers: list[float]) -> Array:
    xx, yy, zz, xy, xz, yz = numbers
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def placement(origin: dict[str, list[float]]) -> pin.SE3:
    turns = np.radians(origin.get("rpy_deg", [0.0, 0.0, 0.0]))
    return pin.SE3(pin.rpy.rpyToMatrix(*turns), np.array(origin["xyz"]))


def pinocchio_model(robot: dict[str, Any]) -> pin.Model:
    """A chain on a free base; a fixed link belongs to what carries it."""
    model = pin.Model()
    carrier = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    model.addBodyFrame("base", carrier, pin.SE3.Identity(), 0)
    place = pin.SE3.Identity()
    for link in [{**robot["base"], "com": [0.0, 0.0, 0.0]}, *robot["links"]]:
        if "origin" in link:
            place = place * placement(link["origin"])
            if link.get("joint") != "fixed":
                kind = pin.JointModelRevoluteUnaligned(np.array(link.get("axis", [0.0, 0.0, 1.0])))
                carrier = model.addJoint(carrier, kind, place, link["name"])
                place = pin.SE3.Identity()
        inertia = pin.Inertia(link["mass"], np.array(link["com"]), inertia_matrix(link["inertia"]))
        model.appendBodyToJoint(carrier, inertia, place)
    return model


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("seed", range(5))
def test_dynamics_are_pinocchios_of_the_same_file(name: str, seed: int) -> None:
    robot = find_robot(name)
    model = pinocchio_model(content(name))
    oracle = TreeOracle(model, "base", robot.all_joint_names, seed)
    assert_same_dynamics(robot, oracle, seed)


@pytest.mark.parametrize("name", NAMES)
def test_every_published_inertia_is_that_of_a_body(name: str) -> None:
    """No principal moment exceeds the sum of the others: nothing had to be repaired."""
    file = content(name)
    for body in [file["base"], *file["links"]]:
        moments = np.linalg.eigvalsh(inertia_matrix(body["inertia"]))
        assert moments[0] > 0.0
        assert moments[2] <= moments[:2].sum()


def stretched(robot: Robot) -> Array:
    """From the first joint to the tool with all joints at zero, m, on the base's axes."""
    zero = np.zeros(robot.n)
    frame = tool_state(robot, UPRIGHT, zero)  # its position is from the whole's centre of mass
    whole = (robot.mass[:, None] * body_positions(robot)).sum(axis=0) / robot.mass.sum()
    return frame.position + whole - robot.rotation[0] @ robot.offset[0]


def body_positions(robot: Robot) -> Array:
    """(bodies, 3) m, centres of mass from the base's, all joints at zero, of a chain."""
    rotation, at, positions = np.eye(3), np.zeros(3), [np.zeros(3)]
    for joint in range(robot.n):
        rotation = rotation @ robot.rotation[joint]
        at = at + rotation @ robot.offset[joint]
        positions.append(at + rotation @ robot.com[joint + 1])
    return np.array(positions)


def test_sizes_of_the_first_are_those_of_its_sources() -> None:
    robot = find_robot("canadarm")
    reach = stretched(robot)
    assert reach[0] == pytest.approx(-(6.377 + 7.06 + 0.4572 + 0.762 + 0.6604), abs=1e-12)
    assert np.linalg.norm(reach) == pytest.approx(15.0, rel=0.03)
    assert robot.mass[1:].sum() == pytest.approx(410.0 - 63.24, rel=0.05)
    pound, slug_ft2 = 0.45359237, 14.59390294 * 0.3048**2
    assert robot.mass[0] == pytest.approx(231300.0 * pound, rel=1e-5)
    published = np.array([953159.0, 7465080.0, 7747580.0]) * slug_ft2
    np.testing.assert_allclose(np.diag(robot.inertia[0]), published, rtol=1e-5)
    assert abs(robot.inertia[0][0, 2]) == pytest.approx(140307.0 * slug_ft2, rel=1e-5)


def test_the_second_is_the_same_from_either_end() -> None:
    """It walks end over end: its joints' offsets and the masses of its ends are symmetric."""
    links = content("canadarm2")["links"]
    masses = [link["mass"] for link in links]
    assert masses[:3] == masses[:4:-1]
    steps = [np.abs(link["origin"]["xyz"]) for link in links[1:]]
    tool = np.abs(content("canadarm2")["tool"]["origin"]["xyz"])
    for near, far in zip(steps[:3], [tool, *steps[:4:-1]], strict=False):
        np.testing.assert_array_equal(near, far)
    robot = find_robot("canadarm2")
    assert stretched(robot)[0] == pytest.approx(2 * 7.11 + 1.3589, abs=1e-12)
    assert sum(masses) == pytest.approx(1505.32)
