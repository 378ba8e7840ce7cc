"""Friction, the disturbance (61) and the payload, against the numbers of the paper."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import ValidationError
from random_robots import random_robot
from random_trees import KINDS, random_bodies

from space_robot_model.dynamics.model import MOST_JOINTS
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import MOST_WHEELS, RobotNames
from space_robot_sim.environment.disturbance import (
    Disturbance,
    DisturbanceSettings,
    disturbance_torque,
)
from space_robot_sim.environment.friction import (
    Friction,
    FrictionSettings,
    StuckJoint,
    coefficients,
    friction_torque,
)
from space_robot_sim.environment.payload import PayloadSettings, with_payload
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.faults.schedule import Schedule
from space_robot_sim.plant.faults import PLANT_KINDS

Array = NDArray[np.float64]
FOUR = random_robot(np.random.default_rng(4), 4)


def disturbance(n: int, scale: float, time: float) -> Array:
    out = np.full(n + 3, np.nan)
    disturbance_torque(Disturbance.build(n, DisturbanceSettings(scale=scale)), time, out)
    return out


def test_friction_of_the_largest_robot_with_the_most_wheels_is_each_ones_own() -> None:
    """All rows of the record are there, and none reaches into another."""
    robot = random_robot(np.random.default_rng(1), MOST_JOINTS)
    joints = Friction.build(robot, FrictionSettings(coulomb=0.3, viscous=0.7))
    wheels = np.arange(1.0, MOST_WHEELS + 1.0)
    Friction.add_wheels(joints, 10.0 * wheels, 100.0 * wheels)
    rates = np.full(MOST_JOINTS + MOST_WHEELS, 2.0)
    out = np.full(rates.size, np.nan)
    friction_torque(joints, rates, np.ones(rates.size), out)
    np.testing.assert_array_equal(out[:MOST_JOINTS], np.full(MOST_JOINTS, 0.3 + 0.7 * 2.0))
    np.testing.assert_array_equal(out[MOST_JOINTS:], 10.0 * wheels + 100.0 * wheels * 2.0)
    assert joints.count == rates.size
    assert joints.set_valued == float(FrictionSettings().set_valued)


def friction(joints: Friction, joint: int, rate: float) -> float:
    """The friction of one joint that turns alone."""
    velocities = np.zeros(int(joints.count))
    velocities[joint] = rate
    out = np.full(velocities.size, np.nan)
    friction_torque(joints, velocities, np.sign(velocities), out)
    assert not np.delete(out, joint).any()
    return float(out[joint])


def equation_61(n: int, k: float, t: float) -> Array:
    """As printed, joints beyond the third like the fourth."""
    pi = np.pi
    base = 0.010 * k * (np.sin(pi * t) + np.sin(1.5 * pi * t))
    inner = 0.005 * k * (np.sin(0.5 * pi * t) + np.sin(pi * t))
    outer = 0.002 * k * np.sin(0.5 * pi * t)
    return np.array([*[base] * 3, *[inner] * 3, *[outer] * 6][: n + 3])


@settings(max_examples=40)
@given(st.integers(1, 9), st.sampled_from([0.0, 1.0, 2.0, 3.0]), st.floats(0.0, 30.0, width=32))
def test_disturbance_is_equation_61(n: int, scale: float, time: float) -> None:
    """At any time, for all cases' amplitudes and any number of joints."""
    np.testing.assert_allclose(
        disturbance(n, scale, time), equation_61(n, scale, time), rtol=1e-12, atol=1e-15
    )


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_disturbance_writes_nothing_behind_a_short_robots_array(n: int) -> None:
    memory = np.full(n + 3 + 9, -7.0)
    sines = Disturbance.build(n, DisturbanceSettings(scale=1.0))
    disturbance_torque(sines, 0.5, memory[: n + 3])
    np.testing.assert_allclose(memory[: n + 3], equation_61(n, 1.0, 0.5), rtol=1e-12)
    np.testing.assert_array_equal(memory[n + 3 :], -7.0)


def test_disturbance_at_given_times() -> None:
    """Half a second into case 2, and two seconds into it, by hand."""
    root = np.sqrt(0.5)
    expected = [0.010 * (1 + root)] * 3 + [0.005 * (root + 1)] * 3 + [0.002 * root] * 3
    np.testing.assert_allclose(disturbance(6, 1.0, 0.5), expected, rtol=1e-12)
    np.testing.assert_allclose(disturbance(6, 3.0, 2.0), np.zeros(9), atol=1e-16)


def test_without_a_scale_nothing_disturbs() -> None:
    """Not even a negative zero."""
    out = disturbance(6, 0.0, 1.234)
    np.testing.assert_array_equal(out, np.zeros(9))
    assert not np.signbit(out).any()


@given(st.floats(-50.0, 50.0), st.integers(0, 3))
def test_friction_opposes_the_motion(rate: float, joint: int) -> None:
    """(27): the torque it takes from the joint has the sign of the rate, so power is lost."""
    torque = friction(Friction.build(FOUR, FrictionSettings()), joint, rate)
    expected = 0.02 * (rate > 0) - 0.02 * (rate < 0) + 0.2 * rate
    assert torque == pytest.approx(expected, rel=1e-14)
    assert torque * rate >= 0.0
    assert friction(Friction.build(FOUR, FrictionSettings()), joint, -rate) == -torque


@given(st.lists(st.floats(0.0, 9.0), min_size=8, max_size=8), st.sampled_from([-0.5, 0.0, 0.25]))
def test_each_joint_has_its_own_friction(coefficients: list[float], rate: float) -> None:
    """As a stuck joint has."""
    joints = Friction.build(FOUR, FrictionSettings())
    joints.coulomb[:4], joints.viscous[:4] = coefficients[:4], coefficients[4:]
    for joint in range(4):
        coulomb, viscous = coefficients[joint], coefficients[4 + joint]
        expected = coulomb * np.sign(rate) + viscous * rate
        assert friction(joints, joint, rate) == expected


def test_a_robots_own_friction_comes_before_the_settings() -> None:
    """And the settings' before none, but for passive joints, which have their own alone."""
    spring = {"stiffness": 9.0, "damping": 0.1}
    body = {"mass": 2.0, "inertia": [0.1, 0.1, 0.1, 0.0, 0.0, 0.0], "com": [0.1, 0.0, 0.0]}
    links = [
        {"name": "panel", **body, "passive": spring},
        {"name": "own", **body, "friction": {"coulomb": 0.3, "viscous": 0.0}},
        {"name": "usual", **body},
        {
            "name": "rubbing",
            **body,
            "passive": spring,
            "friction": {"coulomb": 0.0, "viscous": 2.0},
        },
    ]
    base = {key: body[key] for key in ("mass", "inertia")}
    robot = Robot.from_dict({"robot": {"name": "four", "base": base, "links": links}})
    assert robot.all_joint_names == ("own", "usual", "panel", "rubbing")
    found = coefficients(robot, FrictionSettings(coulomb=0.02, viscous=0.2))
    assert found.tolist() == [[0.3, 0.0], [0.02, 0.2], [0.0, 0.0], [0.0, 2.0]]
    friction = Friction.build(robot, FrictionSettings(coulomb=0.02, viscous=0.2))
    assert friction.viscous[:4].tolist() == [found[j, 1] for j in robot.order]


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.lists(st.sampled_from(KINDS), min_size=2, max_size=8))
def test_a_stuck_joint_is_the_one_named(seed: int, kinds: list[str]) -> None:
    """Of a tree, in which passive joints and other branches come before it; and it comes free."""
    bodies = random_bodies(np.random.default_rng(seed), ["revolute", *kinds])
    robot = Robot.of_tree("tree", bodies)
    names = RobotNames(robot.joint_names, passive=robot.passive_names)
    friction = Friction.build(robot, FrictionSettings())
    sound = friction.coulomb.copy()
    rows = {robot.all_joint_names[joint]: row for row, joint in enumerate(robot.order)}
    for name in robot.joint_names:
        texts = [f"stuck_joint@1-2:{name}=9"]
        stuck = StuckJoint(Schedule(parse_faults(texts, PLANT_KINDS), 0, 0.5, names))
        stuck.apply(2, friction)
        expected = sound.copy()
        expected[rows[name]] = 9.0
        np.testing.assert_array_equal(friction.coulomb, expected)
        stuck.apply(4, friction)
        np.testing.assert_array_equal(friction.coulomb, sound)


def test_friction_of_a_joint_that_breaks_away_opposes_what_comes() -> None:
    """Not yet turning, it has the whole Coulomb torque; one that stands has none of its own."""
    joints, out = Friction.build(FOUR, FrictionSettings(coulomb=5.0)), np.empty(4)
    friction_torque(joints, np.zeros(4), np.array([0.0, 1.0, -1.0, 0.0]), out)
    np.testing.assert_array_equal(out, [0.0, 5.0, -5.0, 0.0])


def test_payload_replaces_mass_and_inertia_of_the_last_link(paper_robot: Robot) -> None:
    """Case 3's: 10 kg; the CoM vector and every other body unchanged."""
    payload = PayloadSettings(mass=10.0, inertia=[1.2, 0.6, 1.0, 0.0, 0.0, 0.0])
    loaded = with_payload(paper_robot, payload)
    assert loaded.mass[-1] == 10.0
    np.testing.assert_array_equal(loaded.inertia[-1], np.diag([1.2, 0.6, 1.0]))
    np.testing.assert_array_equal(loaded.com, paper_robot.com)
    np.testing.assert_array_equal(loaded.mass[:-1], paper_robot.mass[:-1])
    np.testing.assert_array_equal(loaded.inertia[:-1], paper_robot.inertia[:-1])
    assert loaded.model.mass[6] == 10.0, "the compiled algorithms must see the payload"


def test_payload_sits_on_the_last_link_of_any_robot() -> None:
    robot = random_robot(np.random.default_rng(7), 2)
    loaded = with_payload(robot, PayloadSettings(mass=99.0))
    np.testing.assert_array_equal(loaded.mass, [*robot.mass[:2], 99.0])


def test_no_payload_is_the_nominal_robot(paper_robot: Robot) -> None:
    assert with_payload(paper_robot, PayloadSettings()) is paper_robot


@pytest.mark.parametrize(
    ("section", "values"),
    [
        (FrictionSettings, {"coulomb": -0.1}),
        (FrictionSettings, {"viscous": float("nan")}),
        (DisturbanceSettings, {"scale": -1.0}),
        (DisturbanceSettings, {"base_frequencies": [1.0]}),
        (PayloadSettings, {"mass": -5.0}),
        (PayloadSettings, {"inertia": [1.0, 1.0, 9.0, 0.0, 0.0, 0.0]}),
        (PayloadSettings, {"weight": 5.0}),
    ],
)
def test_settings_refuse_what_is_not_physical(
    section: type[FrictionSettings], values: dict[str, float]
) -> None:
    with pytest.raises(ValidationError, match=next(iter(values))):
        section(**values)
