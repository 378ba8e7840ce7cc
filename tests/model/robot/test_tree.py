"""Trees of bodies and their momenta, motors behind gears too, against Pinocchio."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import (
    TreeOracle,
    assert_same_dynamics,
    pinocchio_model,
    pinocchio_state,
    pinocchio_tree,
    rotation_of,
)
from oracles.rotors import RotorEquations, pinocchio_momentum, random_motor_rotors
from robots import oscillator
from scipy.spatial.transform import Rotation
from strategies import (
    BASE,
    SEEDS,
    TREES,
    random_gears,
    random_quaternion,
    random_robot,
    random_state,
    random_tree,
    with_gears,
)

from space_robot_model.robot import Robot
from space_robot_model.robot.gears import flexible_model, geared_joints, motor_momentum, rotor_rows
from space_robot_model.robot.mission_document import QUATERNION
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.names import other_meaning
from space_robot_model.robot.parts import Base, Body, Gear, RobotTree, Spring
from space_robot_model.robot.placements import body_frames
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES
from space_robot_sim.environment.disturbance_table import BASE as BASE_LOADS
from space_robot_sim.environment.disturbance_table import TIME


@settings(max_examples=60)
@given(seed=SEEDS, kinds=TREES)
def test_dynamics_are_pinocchios(seed: int, kinds: list[str]) -> None:
    """Branches, prismatic, fixed and passive joints about any axis, told in any order."""
    tree = random_tree(np.random.default_rng(seed), kinds)
    robot = Robot.from_tree(tree)
    oracle = TreeOracle(pinocchio_tree(tree), BASE, robot.all_joint_names, seed)
    assert_same_dynamics(robot, oracle, seed)


@settings(max_examples=30)
@given(seed=SEEDS, kinds=TREES)
def test_nominal_robot_is_locked_at_rest(seed: int, kinds: list[str]) -> None:
    """Pinocchio's tree with fixed joints where the springs are at rest, in the base's own frame."""
    tree = random_tree(np.random.default_rng(seed), kinds)
    robot = Robot.from_tree(tree)
    own = pinocchio_tree(tree)
    locked = pinocchio_tree(replace(tree, links=[_locked(link) for link in tree.links]))
    base_com = own.inertias[own.getJointId("root")].lever
    oracle = TreeOracle(locked, BASE, robot.joint_names, seed, base_com)
    assert robot.nominal.joint_names == robot.joint_names
    assert not robot.nominal.passive_names
    assert_same_dynamics(robot.nominal, oracle, seed)


def _locked(link: Body) -> Body:
    if link.passive is None:
        return link
    rest, offset, turn = link.passive.rest, link.offset, np.eye(3)
    if link.joint == "prismatic":
        offset = offset + rest * link.axis
    else:
        turn = Rotation.from_rotvec(rest * link.axis).as_matrix()
    return replace(link, joint="fixed", rotation=link.rotation @ turn, offset=turn.T @ offset)


def test_no_joint_has_the_name_of_something_else() -> None:
    """Those are names of axes and columns in packages that this one does not import."""
    columns = {TIME, *BASE_LOADS, *QUATERNION}
    names = {*BASE_AXES, *columns, "base", "joints", "all", "*", "12", "wheel_1", "thruster_10"}
    assert all(map(other_meaning, names))
    assert other_meaning("elbow_rate", ["elbow"])
    assert not any(map(other_meaning, ["elbow_rate", "joint_1", "base_yaw", "wheel", "time_1"]))


HULL = Base(5.0, np.eye(3), name="hull")
ARM = Body(name="arm", joint_name="j", parent="hull", mass=1.0, inertia=np.eye(3), com=np.zeros(3))


def arms(count: int, spring: Spring | None = None) -> list[Body]:
    """Links on the hull."""
    return [replace(ARM, name=f"a{k}", joint_name=f"j{k}", passive=spring) for k in range(count)]


SOFT = Spring(1.0, 0.0)
LEG = replace(ARM, name="leg", parent="leg", joint_name="k")
THIN = replace(ARM, inertia=np.zeros((3, 3)))
BAD: list[tuple[list[Body], str]] = [
    ([ARM, replace(ARM, joint_name="k")], "body names must differ, 'arm' occurs twice"),
    ([ARM, replace(ARM, name="leg")], "joint names must differ, 'j' occurs twice"),
    ([replace(ARM, parent="x")], "'x' of 'arm' is not a body: choose one of hull, arm"),
    ([ARM, LEG], "not connected to the base"),
    ([replace(ARM, mass=0.0)], "moving body 'arm' has no mass"),
    ([THIN], "the inertia of body 'arm' must be positive definite"),
    (arms(1, SOFT), "a robot needs at least one actuated joint"),
    (arms(65), "at most 64 moving joints can be flown, got 65"),
    ([ARM, *arms(25, SOFT)], "at most 24 passive joints can be flown, got 25"),
]


@pytest.mark.parametrize(("links", "said"), BAD, ids=range(len(BAD)))
def test_what_is_no_tree_is_said_in_one_line(links: list[Body], said: str) -> None:
    with pytest.raises(InputError) as raised:
        Robot.from_tree(RobotTree("bad", HULL, links), "file.yaml")
    assert str(raised.value).startswith("file.yaml: ")
    assert said in str(raised.value)
    assert "\n" not in str(raised.value)


def test_many_bodies_in_a_row_are_walked_without_recursion() -> None:
    chain = [
        replace(
            ARM,
            name=f"b{k}",
            parent=f"b{k - 1}" if k else "hull",
            joint_name=f"j{k}",
            joint="fixed" if k else "revolute",
        )
        for k in range(3000)
    ]
    assert Robot.from_tree(RobotTree("long", HULL, chain[::-1])).mass.tolist() == [5.0, 3000.0]


def motion_of(states: list) -> Motion:
    """Random states as a flight; their velocities are on inertial axes, a flight's in the base."""
    omega = [rotation_of(state.quaternion).as_matrix().T @ state.w0 for state in states]
    return Motion(
        np.array([state.quaternion for state in states]),
        np.array(omega),
        np.array([state.theta for state in states]),
        np.array([state.rate for state in states]),
    )


@given(SEEDS, st.integers(1, 8))
def test_it_is_pinocchios_centroidal_momentum(seed: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    robot, states = random_robot(rng, n), [random_state(rng, n) for _ in range(3)]
    model = pinocchio_model(robot)
    data, found = model.createData(), robot_momentum(robot, motion_of(states))
    for k, state in enumerate(states):
        wanted = pin.computeCentroidalMomentum(model, data, *pinocchio_state(state)).angular
        size = np.linalg.norm(wanted) + np.linalg.norm(state.velocity)
        np.testing.assert_allclose(found.angular[k], wanted, rtol=0.0, atol=1e-12 * size * 1e3)
        np.testing.assert_allclose(found.centre_of_mass[k], data.com[0], rtol=1e-11, atol=1e-12)


def test_the_base_has_its_own_about_the_common_centre_of_mass(paper_robot: Robot) -> None:
    still, theta = np.zeros((3, 6)), np.tile([0.3, -0.8, 1.1, 0.2, -0.5, 0.9], (3, 1))
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (3, 1))
    found = robot_momentum(paper_robot, Motion(upright, np.eye(3), theta, still))
    lever = found.centre_of_mass[0]
    alone = paper_robot.inertia[0] + paper_robot.mass[0] * (
        lever @ lever * np.eye(3) - np.outer(lever, lever)
    )
    np.testing.assert_allclose(found.base, alone, rtol=1e-12, atol=1e-10)


TREE = ("revolute", "passive revolute", "prismatic", "revolute", "fixed", "passive prismatic")


def tree(seed: int) -> tuple[Robot, np.random.Generator]:
    rng = np.random.default_rng(seed)
    return random_gears(rng, Robot.from_tree(random_tree(rng, TREE))), rng


@given(SEEDS)
@settings(max_examples=40)
def test_couplings_of_rotors_are_those_of_the_inertia_matrix(seed: int) -> None:
    """In any attitude and posture; and all of it at rest upright."""
    robot, rng = tree(seed)
    equations, n = RotorEquations(robot, random_motor_rotors(rng, robot)), robot.joint_count
    quaternion, theta = random_quaternion(rng), rng.uniform(-3.0, 3.0, n)
    expected, _ = equations.matrices(quaternion, theta, np.zeros(equations.size))
    upright, _ = equations.matrices(np.eye(4)[0], theta, np.zeros(equations.size))
    size = 1e-12 * np.abs(expected).max()
    model = flexible_model(robot, theta)
    np.testing.assert_allclose(model.inertia, upright, rtol=0.0, atol=size)
    axes = rotation_of(quaternion).as_matrix().T[:, :, np.newaxis]
    frames = body_frames(robot, axes, theta[:, np.newaxis])
    rows, reflected = rotor_rows(robot, {frame.body: frame for frame in frames})
    np.testing.assert_allclose(
        rows, expected[6 + n :, : 6 + n], rtol=0.0, atol=1e-12 * np.abs(rows).max()
    )
    np.testing.assert_allclose(
        np.diag(reflected), expected[6 + n :, 6 + n :], rtol=0.0, atol=1e-12 * reflected.max()
    )


@given(SEEDS)
@settings(max_examples=30)
def test_robot_and_motors_have_the_momentum_of_all_bodies(seed: int) -> None:
    """By Pinocchio, about the common centre of mass."""
    robot, rng = tree(seed)
    rotors, state = random_motor_rotors(rng, robot), random_state(rng, robot.joint_count)
    speeds = 10.0 * rng.normal(size=len(rotors))
    _, expected = pinocchio_momentum(robot, rotors, state, speeds)
    quaternion, theta = state.quaternion[None], state.theta[None]
    omega = rotation_of(state.quaternion).inv().apply(state.w0)
    motion = Motion(quaternion, omega[None], theta, state.rate[None])
    motors = motor_momentum(robot, quaternion, theta, speeds[None])
    actual = (robot_momentum(robot, motion).angular + motors)[0]
    np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("damping", [0.0, 0.4, 1e4])
def test_the_fastest_motion_is_the_two_masses(damping: float) -> None:
    """Absolute roots of ``s^2 + (1/B + 1/I) (D s + K)``."""
    gear, link = Gear(2e-5, 100.0, 150.0, damping), 0.5
    lighter = 1.0 / gear.reflected_inertia + 1.0 / link
    roots = np.roots([1.0, lighter * damping, lighter * gear.stiffness])
    fastest = flexible_model(oscillator(gear, link), np.zeros(1)).fastest
    assert fastest == pytest.approx(np.abs(roots).max(), rel=1e-9)


def test_stiffness_stands_between_joint_and_motor() -> None:
    rng = np.random.default_rng(3)
    robot = with_gears(
        random_robot(rng, 3), [Gear(1e-3, 10.0, 7.0, 2.0), None, Gear(1e-3, 5.0, 9.0)]
    )
    assert geared_joints(robot) == [0, 2]
    model, stretch = flexible_model(robot, np.zeros(3)), np.zeros((2, 11))
    stretch[0, [6, 9]] = stretch[1, [8, 10]] = -1.0, 1.0
    for matrix, values in ((model.stiffness, [7.0, 9.0]), (model.damping, [2.0, 0.0])):
        np.testing.assert_array_equal(matrix, stretch.T @ np.diag(values) @ stretch)
