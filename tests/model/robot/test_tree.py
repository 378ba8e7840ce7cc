"""A tree of bodies becomes the robot that moves as they would: compared with Pinocchio's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import TreeOracle, assert_same_dynamics, pinocchio_tree
from scipy.spatial.transform import Rotation
from strategies import BASE, KINDS, SEEDS, random_bodies

from space_robot_model.robot import Robot
from space_robot_model.robot.mission_document import QUATERNION
from space_robot_model.robot.tree import Body, Joint, Spring, flatten, other_meaning
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES
from space_robot_sim.environment.disturbance_table import BASE as BASE_LOADS
from space_robot_sim.environment.disturbance_table import TIME

SOME_TREES = st.lists(st.sampled_from(KINDS), max_size=11)


def tree_of(seed: int, kinds: list[str]) -> list[Body]:
    """A random tree with one actuated joint at least."""
    return random_bodies(np.random.default_rng(seed), ["revolute", *kinds])


@settings(max_examples=60)
@given(seed=SEEDS, kinds=SOME_TREES)
def test_dynamics_are_pinocchios(seed: int, kinds: list[str]) -> None:
    """Branches, prismatic, fixed and passive joints about any axis, told in any order."""
    bodies = tree_of(seed, kinds)
    robot = Robot.of_tree("tree", bodies)
    oracle = TreeOracle(pinocchio_tree(bodies), BASE, robot.all_joint_names, seed)
    assert_same_dynamics(robot, oracle, seed)


@settings(max_examples=30)
@given(seed=SEEDS, kinds=SOME_TREES)
def test_nominal_robot_is_locked_at_rest(seed: int, kinds: list[str]) -> None:
    """Pinocchio's tree with fixed joints where the springs are at rest, in the base's own frame."""
    bodies = tree_of(seed, kinds)
    robot = Robot.of_tree("tree", bodies)
    own = pinocchio_tree(bodies)
    locked = pinocchio_tree([_locked(body) for body in bodies])
    base_com = own.inertias[own.getJointId("root")].lever
    oracle = TreeOracle(locked, BASE, robot.joint_names, seed, base_com)
    assert robot.nominal.joint_names == robot.joint_names
    assert not robot.nominal.passive_names
    assert_same_dynamics(robot.nominal, oracle, seed)


def _locked(body: Body) -> Body:
    joint = body.joint
    if joint is None or joint.spring is None:
        return body
    rest, offset, turn = joint.spring.rest, joint.offset, np.eye(3)
    if joint.kind == "prismatic":
        offset = offset + rest * joint.axis
    else:
        turn = Rotation.from_rotvec(rest * joint.axis).as_matrix()
    return replace(body, joint=Joint(joint.name, "fixed", joint.rotation @ turn, turn.T @ offset))


def test_no_joint_has_the_name_of_something_else() -> None:
    """Those are names of axes and columns in packages that this one does not import."""
    columns = {TIME, *BASE_LOADS, *QUATERNION}
    names = {*BASE_AXES, *columns, "base", "joints", "all", "*", "12", "wheel_1", "thruster_10"}
    assert all(map(other_meaning, names))
    assert other_meaning("elbow_rate", ["elbow"])
    assert not any(map(other_meaning, ["elbow_rate", "joint_1", "base_yaw", "wheel", "time_1"]))


@given(seed=SEEDS, kinds=SOME_TREES)
def test_the_bodies_of_a_robot_make_the_same_robot(seed: int, kinds: list[str]) -> None:
    robot = Robot.of_tree("tree", tree_of(seed, kinds))
    again = Robot.of_tree("tree", robot.bodies())
    assert again.all_joint_names == robot.all_joint_names
    for name in ("mass", "inertia", "com", "parent", "rotation", "offset", "is_prismatic"):
        np.testing.assert_array_equal(getattr(again, name), getattr(robot, name))
    assert (again.limits, again.springs) == (robot.limits, robot.springs)
    assert [tool.name for tool in again.tools] == [tool.name for tool in robot.tools]


HULL = Body("hull", 5.0, np.eye(3), np.zeros(3))
ARM = Body("arm", 1.0, np.eye(3), np.zeros(3), "hull", Joint("j"))
BAD: dict[str, tuple[Callable[[], list[Body]], str]] = {
    "two of a name": (
        lambda: [HULL, ARM, replace(ARM, joint=Joint("k"))],
        "body names must differ, 'arm' occurs twice",
    ),
    "two joints of a name": (
        lambda: [HULL, ARM, replace(ARM, name="leg")],
        "joint names must differ, 'j' occurs twice",
    ),
    "no base": (lambda: [replace(ARM, parent="arm")], "one base, got 0"),
    "two bases": (lambda: [HULL, replace(HULL, name="moon"), ARM], "one base, got 2"),
    "unknown parent": (
        lambda: [HULL, replace(ARM, parent="x")],
        "parent 'x' of 'arm' is not a body: choose one of hull, arm",
    ),
    "circle": (
        lambda: [HULL, ARM, replace(ARM, name="leg", parent="leg", joint=Joint("k"))],
        "not connected to the base",
    ),
    "no mass": (lambda: [HULL, replace(ARM, mass=0.0)], "moving body 'arm' has no mass"),
    "no inertia": (
        lambda: [HULL, replace(ARM, inertia=np.zeros((3, 3)))],
        "the inertia of body 'arm' must be positive definite",
    ),
    "nothing actuated": (
        lambda: [HULL, replace(ARM, joint=Joint("j", spring=Spring(1.0, 0.0)))],
        "a robot needs at least one actuated joint",
    ),
    "too many joints": (
        lambda: [HULL, *(replace(ARM, name=f"a{k}", joint=Joint(f"j{k}")) for k in range(65))],
        "at most 64 moving joints can be flown, got 65",
    ),
    "too many passive ones": (
        lambda: [
            HULL,
            ARM,
            *(
                replace(ARM, name=f"a{k}", joint=Joint(f"j{k}", spring=Spring(1.0, 0.0)))
                for k in range(25)
            ),
        ],
        "at most 24 passive joints can be flown, got 25",
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_tree_is_said_in_one_line(name: str) -> None:
    bodies, said = BAD[name]
    with pytest.raises(InputError) as raised:
        Robot.of_tree("bad", bodies(), "file.yaml")
    assert str(raised.value).startswith("file.yaml: ")
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


def test_many_bodies_in_a_row_are_walked_without_recursion() -> None:
    chain = [
        replace(
            ARM,
            name=f"b{k}",
            parent=f"b{k - 1}" if k else "hull",
            joint=Joint(f"j{k}", "fixed" if k else "revolute"),
        )
        for k in range(3000)
    ]
    walked = flatten([HULL, *chain[::-1]])
    assert [link.body.mass for link in walked[1:]] == [3000.0]
