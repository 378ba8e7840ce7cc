"""What a capture and a release do to the velocities, against Pinocchio and the momenta's sum."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import pinocchio_model, pinocchio_state, rotation_of, visited
from random_robots import State, random_inertia, random_quaternion, random_robot, random_state

from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import mass_matrix
from space_robot_model.robot.tree import Tool
from space_robot_sim.environment.captures import Captures
from space_robot_sim.environment.events import Capture, Release
from space_robot_sim.environment.grasp import Grasp
from space_robot_sim.environment.impact import Impact
from space_robot_sim.environment.orbit_settings import OrbitSettings
from space_robot_sim.environment.target import Target

Array = NDArray[np.float64]
FEW = settings(max_examples=60, deadline=None)


class Case(NamedTuple):
    """A tree with wheels and its state, and a target that moves of its own."""

    robot: Robot
    state: State
    target: Target
    wheel_axes: Array
    rotors: Array
    speeds: Array
    """rad/s, of the wheels."""

    @property
    def velocity(self) -> Array:
        return np.concatenate([self.state.velocity, self.speeds])

    @property
    def grasp(self) -> Grasp:
        return Grasp.of(self.robot, self.target)

    @property
    def impact(self) -> Impact:
        holding = self.grasp.holding(self.robot)
        q, theta = self.state.quaternion, self.state.theta
        return Impact(holding, self.grasp, q, theta, self.wheel_axes, self.rotors)


def random_tree(rng: np.random.Generator, n: int) -> Robot:
    """Joints that turn and slide, on bodies before them; the tool is on any, turned and off."""
    parents = np.array([int(rng.integers(0, j + 1)) for j in range(n)])
    order: list[int] = []

    def visit(body: int) -> None:
        for joint in np.flatnonzero(parents == body).tolist():
            order.append(joint)
            visit(joint + 1)

    visit(0)
    rotation = rotation_of(random_quaternion(rng)).as_matrix()
    tool = Tool("hand", rotation, rng.normal(size=3), int(rng.integers(0, n + 1)))
    return replace(
        random_robot(rng, n),
        parent=parents,
        order=tuple(order),
        tools=(tool,),
        is_prismatic=rng.random(n) < 0.3,
    )


def random_target(rng: np.random.Generator, relative_to: str) -> Target:
    mass = float(10.0 ** rng.uniform(-1.0, 3.5))
    return Target.from_dict(
        {
            "target": {
                "mass": mass,
                "inertia": random_inertia(rng, 0.1 * mass),
                "place": {
                    "position": rng.normal(size=3).tolist(),
                    "quaternion": random_quaternion(rng).tolist(),
                },
                "motion": {
                    "relative_to": relative_to,
                    "velocity": rng.normal(size=3).tolist(),
                    "angular_velocity": rng.normal(size=3).tolist(),
                },
            }
        }
    )


@st.composite
def cases(draw: st.DrawFn) -> Case:
    """Of up to 8 joints, any carrying the tool or none, with up to 4 wheels."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n, wheels = draw(st.integers(1, 8)), draw(st.sampled_from([0, 0, 1, 3, 4]))
    robot, relative_to = random_tree(rng, n), draw(st.sampled_from(["tool", "inertial"]))
    axes = rng.normal(size=(wheels, 3))
    return Case(
        robot,
        random_state(rng, n),
        random_target(rng, relative_to),
        axes / np.linalg.norm(axes, axis=1, keepdims=True),
        rng.uniform(0.01, 0.1, wheels),
        100.0 * rng.normal(size=wheels),
    )


def tensor_of(target: Target) -> Array:
    """(3, 3) kg m2 about the target's CoM, on its axes."""
    return np.array(target.inertia)[[0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(3, 3)


def target_frame(case: Case) -> tuple[pin.Model, pin.Data, pin.SE3, int]:
    """Pinocchio's robot in the state, the target's place (its CoM, its axes), and its joint."""
    model = pinocchio_model(case.robot)
    data = model.createData()
    pin.forwardKinematics(model, data, *pinocchio_state(visited(case.robot, case.state)))
    (tool,), place = case.robot.tools, case.target.place
    joint = 1 if not tool.body else 2 + case.robot.order.index(tool.body - 1)
    in_hand = pin.SE3(rotation_of(place.quaternion).as_matrix(), np.array(place.position))
    return model, data, pin.SE3(tool.rotation, tool.position) * in_hand, joint


def target_motion(case: Case) -> tuple[Array, Array, Array, Array]:
    """CoM (m from the base's), axes, velocity and angular velocity of the target before."""
    _, data, local, joint = target_frame(case)
    frame = data.oMi[joint] * local
    motion, tool = case.target.motion, case.robot.tools[0]
    v, w = np.array(motion.velocity), np.array(motion.angular_velocity)
    if motion.relative_to == "tool":
        hand = data.oMi[joint].rotation @ tool.rotation
        carried = data.oMi[joint].act(data.v[joint])
        w = hand @ w + carried.angular
        v = hand @ v + carried.linear + np.cross(carried.angular, frame.translation)
    return frame.translation, frame.rotation, v, w


def momentum(robot_model: pin.Model, case: Case, velocity: Array) -> Array:
    """Linear, then angular about the place of the base's CoM, of robot and wheels."""
    n = case.robot.joint_count
    state = case.state._replace(v0=velocity[:3], w0=velocity[3:6], rate=velocity[6 : 6 + n])
    data = robot_model.createData()
    found = pin.computeCentroidalMomentum(
        robot_model, data, *pinocchio_state(visited(case.robot, state))
    )
    spin = case.wheel_axes.T @ (case.rotors * velocity[6 + n :])
    base = rotation_of(state.quaternion).as_matrix()
    angular = found.angular + np.cross(data.com[0], found.linear) + base @ spin
    return np.concatenate([found.linear, angular])


def energy(inertia: Array, case: Case, velocity: Array) -> float:
    """J, of a robot of this inertia and its wheels."""
    size = 6 + case.robot.joint_count
    bare, speeds = velocity[:size], velocity[size:]
    base = rotation_of(case.state.quaternion).as_matrix()
    of_base = case.wheel_axes @ (base.T @ velocity[3:6])
    return float(0.5 * bare @ inertia @ bare + (case.rotors * speeds) @ (of_base + 0.5 * speeds))


def with_target(case: Case) -> pin.Model:
    """Pinocchio's robot with the target as a body of its own on the joint of the tool."""
    model, _, local, joint = target_frame(case)
    tensor = tensor_of(case.target)
    model.appendBodyToJoint(joint, pin.Inertia(case.target.mass, np.zeros(3), tensor), local)
    return model


@FEW
@given(cases())
def test_a_capture_keeps_both_momenta(case: Case) -> None:
    """Of robot, wheels and target, to rounding; any tree, any tool, any motion."""
    place, axes, v, w = target_motion(case)
    tensor = tensor_of(case.target)
    linear = case.target.mass * v
    spin = axes @ tensor @ axes.T @ w
    own = np.concatenate([linear, spin + np.cross(place, linear)])
    before = momentum(pinocchio_model(case.robot), case, case.velocity)
    after = case.impact.capture(case.target.motion, case.velocity)
    scale = max(np.abs(before).max(), np.abs(own).max())
    found = momentum(with_target(case), case, after)
    np.testing.assert_allclose(found, before + own, rtol=0.0, atol=1e-12 * scale)


@FEW
@given(cases())
def test_no_joint_nor_wheel_gets_an_impulse_from_its_motor(case: Case) -> None:
    """The generalised momentum of each is the target's share of it and what it had."""
    _, axes, v, w = target_motion(case)
    model, _, local, joint = target_frame(case)
    impact, n = case.impact, case.robot.joint_count
    after = impact.capture(case.target.motion, case.velocity)
    tensor = tensor_of(case.target)
    own = np.concatenate([case.target.mass * v, axes @ tensor @ axes.T @ w])
    bare, holding = (
        mass_matrix(robot, case.state.quaternion, case.state.theta)
        for robot in (case.robot, case.grasp.holding(case.robot))
    )
    base = rotation_of(case.state.quaternion).as_matrix()
    turning = case.wheel_axes @ base.T  # (W, 3): the wheels' axes on inertial ones
    for wheel in range(len(case.rotors)):
        rates = [
            turning[wheel] @ qdot[3:6] + qdot[6 + n + wheel] for qdot in (case.velocity, after)
        ]
        assert rates[0] == pytest.approx(rates[1], rel=1e-12, abs=1e-11)
    joints = slice(6, 6 + n)
    expected = bare[joints] @ case.velocity[: 6 + n] + impact.jacobian[:, joints].T @ own
    found = holding[joints] @ after[: 6 + n]
    scale = np.abs(holding).max() * max(1.0, np.abs(after[: 6 + n]).max())
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12 * scale)
    # the Jacobian is Pinocchio's, of the target's frame on axes that stand
    frame = pin.Frame("target", joint, 0, local, pin.FrameType.OP_FRAME)
    number = model.addFrame(frame)
    configuration, _ = pinocchio_state(visited(case.robot, case.state))
    jacobian = pin.computeFrameJacobian(
        model, model.createData(), configuration, number, pin.LOCAL_WORLD_ALIGNED
    )
    turn = np.eye(6 + n)
    turn[:3, :3] = turn[3:6, 3:6] = base.T
    expected = (jacobian @ turn)[:, np.argsort([*range(6), *(6 + j for j in case.robot.order)])]
    np.testing.assert_allclose(impact.jacobian[:, : 6 + n], expected, atol=1e-12 * scale)


@FEW
@given(cases())
def test_a_capture_takes_the_energy_of_the_inelastic_impact(case: Case) -> None:
    """``u^T (M^-1 + J H^-1 J^T)^-1 u / 2`` of the bare robot's H; never less than nothing."""
    _, axes, v, w = target_motion(case)
    tensor = tensor_of(case.target)
    mass = np.zeros((6, 6))
    mass[:3, :3], mass[3:, 3:] = case.target.mass * np.eye(3), axes @ tensor @ axes.T
    own, impact, size = np.concatenate([v, w]), case.impact, 6 + case.robot.joint_count
    after = impact.capture(case.target.motion, case.velocity)
    q, theta = case.state.quaternion, case.state.theta
    bare = mass_matrix(case.robot, q, theta)
    before = energy(bare, case, case.velocity) + 0.5 * own @ mass @ own
    lost = before - energy(mass_matrix(case.grasp.holding(case.robot), q, theta), case, after)
    free, jacobian = bare.copy(), impact.jacobian[:, :size]
    base = rotation_of(q).as_matrix()
    for axis, rotor in zip(case.wheel_axes @ base.T, case.rotors, strict=True):
        free[3:6, 3:6] -= rotor * np.outer(axis, axis)  # the wheels turn on as they did
    relative = own - jacobian @ case.velocity[:size]
    reduced = np.linalg.inv(mass) + jacobian @ np.linalg.solve(free, jacobian.T)
    expected = 0.5 * relative @ np.linalg.solve(reduced, relative)
    assert lost >= -1e-12 * before
    assert lost == pytest.approx(expected, rel=1e-8, abs=1e-10 * before)


@FEW
@given(cases())
def test_what_is_at_rest_in_the_hand_is_captured_without_an_impact(case: Case) -> None:
    """Nothing changes to the last bit, nor by a release without a spring."""
    impact = case.impact
    after = impact.capture(case.target.motion, case.velocity)
    at_rest = Target(mass=1.0, inertia=[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]).motion
    np.testing.assert_array_equal(impact.capture(at_rest, after), after)
    np.testing.assert_array_equal(impact.release(0.0, after), after)


@FEW
@given(cases(), st.floats(0.0, 10.0))
def test_a_release_leaves_the_momenta_and_gives_the_spring_s_speed(
    case: Case, speed: float
) -> None:
    """The target goes at ``speed`` along the tool's z, and turns as the hand does."""
    impact, model = case.impact, pinocchio_model(case.robot)
    whole = momentum(with_target(case), case, case.velocity)
    after = impact.release(speed, case.velocity)
    place, axes, _, _ = target_motion(case)
    moving = impact.jacobian @ after
    _, data, _, joint = target_frame(case)
    moving[:3] += speed * (data.oMi[joint].rotation @ case.robot.tools[0].rotation)[:, 2]
    tensor = tensor_of(case.target)
    linear = case.target.mass * moving[:3]
    spin = axes @ tensor @ axes.T @ moving[3:]
    left = np.concatenate([linear, spin + np.cross(place, linear)])
    found = momentum(model, case, after) + left
    scale = max(np.abs(whole).max(), np.abs(left).max())
    np.testing.assert_allclose(found, whole, rtol=0.0, atol=1e-12 * scale)


@FEW
@given(cases(), st.floats(0.0, 10.0))
def test_what_was_before_follows_from_what_is_after(case: Case, speed: float) -> None:
    impact, motion = case.impact, case.target.motion
    scale = np.abs(case.velocity).max()
    back = impact.before_capture(motion, impact.capture(motion, case.velocity))
    np.testing.assert_allclose(back, case.velocity, atol=1e-8 * scale)
    back = impact.before_release(speed, impact.release(speed, case.velocity))
    np.testing.assert_allclose(back, case.velocity, atol=1e-12 * (scale + speed))


def test_two_masses_on_a_line() -> None:
    """By hand: a sliding joint of 1 kg on a base of 3 kg, hit by 2 kg at 1 m/s along the slide.

    The slide's body goes on with the target at 2/3 m/s, the base stays where it is.
    """
    robot = replace(
        random_robot(np.random.default_rng(1), 1),
        mass=np.array([3.0, 1.0]),
        com=np.zeros((2, 3)),
        rotation=np.eye(3)[np.newaxis],
        offset=np.zeros((1, 3)),
        is_prismatic=np.array([True]),
        tools=(Tool("hand", np.eye(3), np.zeros(3), 1),),
    )
    content = {
        "mass": 2.0,
        "inertia": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0],
        "motion": {"relative_to": "inertial", "velocity": [0.0, 0.0, 1.0]},
    }
    target = Target.from_dict({"target": content})
    grasp = Grasp.of(robot, target)
    impact = Impact(
        grasp.holding(robot),
        grasp,
        np.array([1.0, 0.0, 0.0, 0.0]),
        np.zeros(1),
        np.zeros((0, 3)),
        np.zeros(0),
    )
    found = impact.capture(target.motion, np.zeros(7))
    np.testing.assert_allclose(found, [0, 0, 0, 0, 0, 0, 2 / 3], atol=1e-15)


def test_robots_follow_one_another_and_the_bare_one_comes_back_exactly() -> None:
    robot = random_robot(np.random.default_rng(2), 3)
    target = random_target(np.random.default_rng(3), "tool")
    events = [Capture(1.0, target), Release(2.0), Capture(3.0, target)]
    captures = Captures(list(reversed(events)), robot, 5e-4, OrbitSettings())
    masses = [float(captures.robot_at(tick).mass[-1]) for tick in (1999, 2000, 3999, 4000, 6000)]
    bare = float(robot.mass[-1])
    assert masses == [bare, bare + target.mass, bare + target.mass, bare, bare + target.mass]
    assert captures.robot_at(4000) is robot
    assert [captures.next_tick(tick) for tick in (0, 1999, 2000, 6000)] == [
        2000,
        2000,
        4000,
        np.inf,
    ]
