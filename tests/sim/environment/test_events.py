"""Captures and releases: their texts and files, and what they do to the velocities."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from oracles import pinocchio_model, pinocchio_state, rotation_of, to_base_axes
from paths import CONFIG, DATA
from robots import tensor_of
from strategies import (
    RNGS,
    State,
    random_branched_robot,
    random_inertia,
    random_quaternion,
    random_robot,
    random_state,
)

from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Tool
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.captures import Captures
from space_robot_sim.environment.events import Capture, Release, named_targets, parse_events
from space_robot_sim.environment.impact import Grasp, Impact
from space_robot_sim.environment.orbit import OrbitSettings
from space_robot_sim.environment.target import Target

REFUSALS = yaml.safe_load((DATA / "refusals/environment.yaml").read_text("utf-8"))
BODY: dict[str, Any] = {"mass": 2.0, "inertia": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]}
FRAMES = ["tool", "inertial"]
NUMBER = st.floats(-1e3, 1e3)
THREE = st.lists(NUMBER, min_size=3, max_size=3)


def write(folder: Path, **changed: Any) -> Path:
    path = folder / "mine.yaml"
    path.write_text(yaml.safe_dump({"target": {**BODY, **changed}}), "utf-8")
    return path


@given(st.floats(0.0, 1e6), st.integers(0, 2**32 - 1), THREE, THREE, THREE, st.sampled_from(FRAMES))
def test_the_text_of_a_capture_has_all_its_numbers(
    time: float, seed: int, place: list[float], v: list[float], w: list[float], to: str
) -> None:
    motion = {"relative_to": to, "velocity": v, "angular_velocity": w}
    inertia = random_inertia(np.random.default_rng(seed), 1.0)
    content = {"mass": 3.0, "inertia": inertia, "place": {"position": place}, "motion": motion}
    event = Capture(time, Target.from_dict({"target": content}))
    assert parse_events([str(event)]) == [event]
    assert not named_targets([str(event)])


def test_a_target_is_a_shipped_one_or_a_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A path begins where we are or, if nothing is there, at the mission's file."""
    path, elsewhere = write(tmp_path), tmp_path / "elsewhere"
    elsewhere.mkdir()
    texts = [f"capture@1:{path}", "capture@1:mine.yaml"]
    monkeypatch.chdir(tmp_path)
    found = [parse_events([text])[0] for text in texts]
    monkeypatch.chdir(elsewhere)
    found.append(parse_events([texts[1]], tmp_path)[0])
    assert found == [Capture(1.0, Target(**BODY))] * 3
    assert named_targets([*texts, "release@2"]) == [str(path), "mine.yaml"]
    for file in sorted((CONFIG / "targets").glob("*.yaml")):
        (event,) = parse_events([f"capture@1:{file.stem}"])
        assert isinstance(event, Capture)
        assert event.target == Target.from_yaml(file)
        assert event.label == f"capture@1:{file.stem}"


@pytest.mark.parametrize(("texts", "said"), REFUSALS["events"])
def test_what_cannot_be_is_refused_in_one_line(texts: list[str], said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)) as caught:
        parse_events(texts)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("changed", "said"), REFUSALS["targets"])
def test_a_wrong_file_is_refused_with_its_key(
    tmp_path: Path, changed: dict[str, Any], said: str
) -> None:
    with pytest.raises(InputError, match=f"mine.yaml.*{said}") as caught:
        parse_events([f"capture@1:{write(tmp_path, **changed)}"])
    assert "\n" not in str(caught.value)


def test_a_tool_that_the_robot_has_not_is_refused() -> None:
    robot = random_robot(np.random.default_rng(1), 2)
    event = Capture(1.0, Target.from_dict({"target": {**BODY, "tool": "left"}}))
    with pytest.raises(InputError, match="unknown tool 'left' of robot 'random2' for target"):
        Captures([event], robot, 5e-4, OrbitSettings())


@settings(max_examples=150)
@given(
    st.text(max_size=30)
    | st.from_regex(r"(capture|release)@[0-9.e+-]{0,6}(:.{0,20})?", fullmatch=True)
)
def test_any_text_is_read_or_refused(text: str) -> None:
    said = ""
    try:
        parse_events([text])
    except InputError as error:
        said = str(error)
    assert "\n" not in said


class Case(NamedTuple):
    """A tree with wheels and its state, and a target that moves of its own."""

    robot: Robot
    state: State
    target: Target
    wheel_axes: Array
    rotors: Array
    velocity: Array
    """Of base, joints and wheels."""
    impact: Impact
    model: pin.Model
    """Pinocchio's robot, alone."""
    joint: int
    """Of the tool, in Pinocchio."""
    local: pin.SE3
    """The target's place (its CoM, its axes) on it."""
    hand: pin.SE3
    """Where the joint is, the base's CoM at the origin."""
    twist: pin.Motion
    """Of the joint, on inertial axes at the origin."""


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """Of up to 8 joints, any carrying the tool or none, with up to 4 wheels."""
    rng, n = draw(RNGS), draw(st.integers(1, 8))
    count, relative_to = draw(st.sampled_from([0, 0, 1, 3, 4])), draw(st.sampled_from(FRAMES))
    turn = rotation_of(random_quaternion(rng)).as_matrix()
    tool = Tool("hand", turn, rng.normal(size=3), int(rng.integers(0, n + 1)))
    robot, state = replace(random_branched_robot(rng, n), tools=(tool,)), random_state(rng, n)
    mass, vectors = float(10.0 ** rng.uniform(-1.0, 3.5)), rng.normal(size=(3, 3)).tolist()
    place = {"position": vectors[0], "quaternion": random_quaternion(rng).tolist()}
    motion = {"relative_to": relative_to, "velocity": vectors[1], "angular_velocity": vectors[2]}
    content = {"mass": mass, "inertia": random_inertia(rng, 0.1 * mass), "place": place}
    target = Target.from_dict({"target": {**content, "motion": motion}})
    axes, rotors = rng.normal(size=(count, 3)), rng.uniform(0.01, 0.1, count)
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    grasp = Grasp.of(robot, target)
    holding = grasp.holding(robot)
    impact = Impact(holding, grasp, state.quaternion, state.theta, axes, rotors)
    model, joint = pinocchio_model(robot), 1 + tool.body
    data = model.createData()
    pin.forwardKinematics(model, data, *pinocchio_state(state))
    in_hand = pin.SE3(rotation_of(target.place.quaternion).as_matrix(), np.array(vectors[0]))
    local, hand = pin.SE3(turn, tool.position) * in_hand, data.oMi[joint].copy()
    velocity = np.concatenate([state.velocity, 100.0 * rng.normal(size=count)])
    moving = (velocity, impact, model, joint, local, hand, hand.act(data.v[joint]))
    return Case(robot, state, target, axes, rotors, *moving)


def momenta(case: Case, qdot: Array, is_held: bool) -> Array:
    """Of base (also by its wheels) and joints, of the robot alone or with the target in its hand.

    Those of the base are all the linear momentum and all the angular one about its CoM.
    """
    size, model = 6 + case.robot.joint_count, case.model.copy()
    if is_held:
        body = pin.Inertia(case.target.mass, np.zeros(3), tensor_of(case.target))
        model.appendBodyToJoint(case.joint, body, case.local)
    upper = np.triu(pin.crba(model, model.createData(), pinocchio_state(case.state)[0]))
    to_base = to_base_axes(case.state.quaternion, size)
    found: Array = to_base.T @ (upper + np.triu(upper, 1).T) @ to_base @ qdot[:size]
    spin = case.wheel_axes.T @ (case.rotors * qdot[size:])
    found[3:6] += rotation_of(case.state.quaternion).apply(spin)
    return found


def jacobian(case: Case) -> Array:
    """Pinocchio's, of the target's place in the hand, on axes that stand."""
    model, (q, _) = case.model.copy(), pinocchio_state(case.state)
    number = model.addFrame(pin.Frame("t", case.joint, 0, case.local, pin.FrameType.OP_FRAME))
    found = pin.computeFrameJacobian(model, model.createData(), q, number, pin.LOCAL_WORLD_ALIGNED)
    size = 6 + case.robot.joint_count
    return np.asarray(found @ to_base_axes(case.state.quaternion, size))


def brought(case: Case, motion: Array) -> Array:
    """What a target in its place with a velocity and an angular velocity (6,) has, as `momenta`."""
    axes = (case.hand * case.local).rotation
    spin = axes @ tensor_of(case.target) @ axes.T @ motion[3:]
    momentum: Array = jacobian(case).T @ np.concatenate([case.target.mass * motion[:3], spin])
    return momentum


def assert_sum(found: Array, *parts: Array) -> None:
    np.testing.assert_allclose(found, sum(parts), rtol=0.0, atol=1e-11 * np.abs(parts).max())


@settings(max_examples=30)
@given(cases())
def test_a_capture_keeps_both_momenta_and_no_motor_gives_an_impulse(case: Case) -> None:
    """Of any tree, tool and motion; also each wheel's own momentum, and each joint's."""
    given, tool, frame = case.target.motion, case.robot.tools[0], case.hand * case.local
    v, w = np.array(given.velocity), np.array(given.angular_velocity)
    if given.relative_to == "tool":
        axes, twist = case.hand.rotation @ tool.rotation, case.twist
        w = axes @ w + twist.angular
        v = axes @ v + twist.linear + np.cross(twist.angular, frame.translation)
    after = case.impact.capture(given, case.velocity)
    before = momenta(case, case.velocity, is_held=False)
    held = momenta(case, after, is_held=True)
    assert_sum(held, before, brought(case, np.concatenate([v, w])))
    size = 6 + case.robot.joint_count
    turning = case.wheel_axes @ rotation_of(case.state.quaternion).as_matrix().T
    rates = [turning @ qdot[3:6] + qdot[size:] for qdot in (case.velocity, after)]
    np.testing.assert_allclose(rates[1], rates[0], rtol=1e-12, atol=1e-11)
    found = case.impact.jacobian[:, :size]
    np.testing.assert_allclose(found, jacobian(case), rtol=0.0, atol=1e-11)


@settings(max_examples=30)
@given(cases(), st.floats(0.0, 10.0))
def test_a_release_leaves_the_momenta_and_gives_the_spring_s_speed(
    case: Case, speed: float
) -> None:
    """The target goes at ``speed`` along the tool's z, and turns as the hand does."""
    after = case.impact.release(speed, case.velocity)
    moving = case.impact.jacobian @ after
    moving[:3] += speed * (case.hand.rotation @ case.robot.tools[0].rotation)[:, 2]
    whole = momenta(case, case.velocity, is_held=True)
    assert_sum(whole, momenta(case, after, is_held=False), brought(case, moving))
    back, size = case.impact.before_release(speed, after), np.abs(case.velocity).max()
    np.testing.assert_allclose(back, case.velocity, atol=1e-12 * (size + speed))
    motion = case.target.motion
    back = case.impact.before_capture(motion, case.impact.capture(motion, case.velocity))
    np.testing.assert_allclose(back, case.velocity, atol=1e-8 * size)


def test_robots_follow_one_another_and_the_bare_one_comes_back_exactly() -> None:
    robot = random_robot(np.random.default_rng(2), 3)
    target = Target.from_dict({"target": BODY})
    events = [Capture(1.0, target), Release(2.0), Capture(3.0, target)]
    captures = Captures(events, robot, 5e-4, OrbitSettings())
    bare = float(robot.mass[-1])
    for tick, held in ((1999, 0.0), (2000, 2.0), (3999, 2.0), (4000, 0.0), (6000, 2.0)):
        assert captures.robot_at(tick).mass[-1] == bare + held
    assert captures.robot_at(4000) is robot
    following = [captures.next_tick(tick) for tick in (0, 1999, 2000, 6000)]
    assert following == [2000, 2000, 4000, np.inf]
