"""Trees in flight: springs, a user's disturbance, a target in the hand, wheels on the base."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from benches import WHEEL_AXES
from numpy.typing import NDArray
from oracles import assert_close, rotation_of
from oracles.momenta import kinetic_energy, momentum, spring_energy, state_of
from oracles.orbit import BodyMotion, body_motions, whole_momenta
from oracles.rotors import RotorEquations, random_rotors, settings_of
from paths import DATA
from robots import LOCKED, NO_FRICTION, PERIOD, coast, held_place, rigid_robot, tensor_of
from strategies import random_bodies, random_inertia, random_quaternion

from space_robot_model.robot import Robot
from space_robot_model.robot.tree import JointFriction
from space_robot_msgs_py.samples import Command
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.disturbance_table import DisturbanceTable
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.environment.target import Target
from space_robot_sim.plant.plant import Plant, PlantSettings

Array = NDArray[np.float64]
KINDS = (
    *("revolute", "prismatic", "revolute", "fixed"),
    *("passive revolute", "passive prismatic", "passive revolute", "fixed"),
)
TORQUE = np.array([60.0, -40.0, 50.0, 4.0, 9.0, -6.0])
TREES = [(0, "b4"), (1, "b6"), (2, "hull")]
"""Seeds, and the body whose tool is the hand."""
PUSH, CAPTURE, RELEASE, SPEED = 100, 200, 500, 0.7
"""Ticks: the motors push until the first one; then joints and springs move freely. m/s."""


def tree(seed: int, lossless: bool = False) -> Robot:
    """Three joints with motors, one of them sliding, and three with springs, two bodies fixed."""
    bodies = random_bodies(np.random.default_rng(seed), KINDS)
    robot = Robot.of_tree("tree", bodies)
    if lossless:
        springs = tuple(spring._replace(damping=0.0) for spring in robot.springs)
        friction = (JointFriction(),) * robot.joint_count
        robot = replace(robot, springs=springs, friction=friction)
    return robot


def plant_of(robot: Robot, **settings: Any) -> Plant:
    start = {
        "initial_joints_deg": (0.3 * np.arange(robot.n)).tolist(),
        "initial_quaternion": [0.3, -0.8, 0.4, 0.2],
    }
    return Plant(robot, PlantSettings.model_validate({**start, **settings}), PERIOD)


def fly(plant: Plant, torque: Array, ticks: int) -> None:
    for _ in range(ticks):
        plant.step(Command(plant.tick, torque))


def numbers(plant: Plant) -> Array:
    """``[r0, quaternion, theta, v0, w0, thetadot]``, in the robot's order."""
    state = state_of(plant.robot, plant.truth)
    return np.concatenate(
        [plant.truth.base_position, state.quaternion, state.theta, state.velocity]
    )


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_flight_is_the_one_that_scipy_integrates(seed: int) -> None:
    """0.2 s in two holds of torque: motors, springs with damping, friction of the robot's own.

    Base and motors are disturbed by sines; force and torque on the base, on its own axes, and a
    joint by lines of a table.
    """
    robot, viscous, rng = tree(seed), 0.2, np.random.default_rng(seed)
    n, hold, end = robot.n, 200 * PERIOD, 0.2
    wrench = rng.normal(size=(2, 6)) * [80.0, 80.0, 80.0, 30.0, 30.0, 30.0]
    push = np.array([3.0, -2.0])
    columns = [f"base_{kind}_{axis}" for kind in ("force", "torque") for axis in "xyz"]
    table = {name: column.tolist() for name, column in zip(columns, wrench.T, strict=True)}
    table |= {"time": [0.0, end], robot.joint_names[1]: push.tolist()}
    disturbance = DisturbanceSettings(
        scale=1.0,
        base_amplitude=30.0,
        inner_amplitude=3.0,
        base_frequencies=[1.5, 0.0],
        inner_frequencies=[3.0, 0.0],
        table=DisturbanceTable.of(table, "here").text,
    )
    friction = FrictionSettings(coulomb=0.0, viscous=viscous)
    plant = plant_of(robot, friction=friction, disturbance=disturbance)
    equations, own = RotorEquations(robot), np.array(robot.friction)[:, 1]
    usual = np.where(np.arange(robot.joint_count) < n, viscous, 0.0)
    damping = np.where(np.isnan(own), usual, own)
    for k, spring in enumerate(robot.springs):
        damping[n + k] += spring.damping
    expected = numbers(plant)
    for begin, torque in ((0.0, TORQUE), (hold, -0.5 * TORQUE[::-1])):

        def force(t: float, x: Array, torque: Array = torque) -> Array:
            theta, rates, _, _ = equations.parts(x)
            acting, pushed = ((1.0 - t / end) * w[0] + t / end * w[1] for w in (wrench, push))
            of_base = rotation_of(x[3:7] / np.linalg.norm(x[3:7]))
            joints = np.zeros(robot.joint_count)
            joints[:n] = torque[3:] - 3.0 * np.sin(6.0 * np.pi * t)
            joints[1] += pushed
            for k, spring in enumerate(robot.springs):
                joints[n + k] = -spring.stiffness * (theta[n + k] - spring.rest)
            turning = of_base.apply(torque[:3] + acting[3:]) - 30.0 * np.sin(3.0 * np.pi * t)
            return np.concatenate([of_base.apply(acting[:3]), turning, joints - damping * rates])

        expected = equations.fly(expected, begin, begin + hold, force).y[:, -1]
        fly(plant, torque, 200)
        assert_close(numbers(plant), expected, 1e-9)
    assert np.abs(plant.truth.passive_velocities[:3]).max() > 0.05, "springs must swing"


def target_of(rng: np.random.Generator, tool: str) -> Target:
    motion = {
        "relative_to": "inertial",
        "velocity": rng.normal(size=3).tolist(),
        "angular_velocity": rng.normal(size=3).tolist(),
    }
    place = {"position": rng.normal(size=3).tolist(), "quaternion": random_quaternion(rng).tolist()}
    content = {"mass": 30.0, "inertia": random_inertia(rng, 3.0), "tool": tool}
    return Target.from_dict({"target": {**content, "place": place, "motion": motion}})


@pytest.mark.parametrize(("seed", "hand"), TREES)
def test_robot_and_target_keep_their_momenta(seed: int, hand: str) -> None:
    """In the grasp, while it holds, and at the release, with sliding and passive joints."""
    robot, rng = tree(seed, lossless=True), np.random.default_rng(seed)
    target = target_of(rng, f"tool of {hand}")
    (tool,) = (tool for tool in robot.tools if tool.name == target.tool)
    robot = replace(robot, tools=(tool,))
    capture = f"capture@{CAPTURE * PERIOD}:{target.inline}"
    events = [capture, f"release@{RELEASE * PERIOD}:{SPEED}"]
    plant = plant_of(robot, friction=NO_FRICTION, events=events)
    fly(plant, 20.0 * TORQUE, PUSH)

    def whole(*others: BodyMotion) -> tuple[Array, Array]:
        """Momenta of the plant's robot, and of a target beside it."""
        of_robot = momentum(plant.robot, plant.truth)
        of_others = whole_momenta(list(others)) if others else np.zeros((2, 3))
        return of_robot[0] + of_others[0], of_robot[1] + of_others[1]

    def energy() -> float:
        return kinetic_energy(plant.robot, plant.truth) + spring_energy(robot, plant.truth)

    def beside(velocity: Any, w: Any) -> BodyMotion:
        place, axes = held_place(robot, plant.truth, target)
        motion = np.array(velocity), np.array(w)
        return BodyMotion.of(target.mass, place, axes, tensor_of(target), *motion)

    def assert_kept(found: tuple[Array, Array], expected: tuple[Array, Array]) -> None:
        scale = max(1.0, float(np.abs(expected).max()))
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-10 * scale)

    coast(plant, CAPTURE - PUSH - 1)
    alone, before = whole(), energy()
    assert np.linalg.norm(alone[1]) > 1.0
    coast(plant, 1)
    own = beside(target.motion.velocity, target.motion.angular_velocity)
    linear, angular = whole_momenta([own])
    held, struck = whole(), energy()
    assert_kept(held, (alone[0] + linear, alone[1] + angular))
    assert struck < before + own.energy + 0.5 * own.mass * own.velocity @ own.velocity
    assert plant.robot.mass.sum() == pytest.approx(robot.mass.sum() + 30.0)

    coast(plant, RELEASE - CAPTURE - 1)
    assert_kept(whole(), held)
    assert energy() == pytest.approx(struck, rel=1e-8)
    coast(plant, 1)
    body = body_motions(robot, plant.truth)[tool.body]
    w = np.linalg.solve(body.inertia, body.spin)
    place, _ = held_place(robot, plant.truth, target)
    along = body.axes @ tool.rotation[:, 2]
    gone = body.velocity + np.cross(w, place - body.position) + SPEED * along
    assert_kept(whole(beside(gone, w)), held)
    assert plant.robot is plant.captures.robot_at(0)


SMOOTH = FrictionSettings(coulomb=0.0, viscous=0.0)


def test_wheels_go_through_rest_and_come_to_rest_as_the_formulas_say() -> None:
    """One is driven through zero speed, one stops and sticks, one breaks away, one stays.

    The base is too heavy to be turned by them.
    """
    spin, coulomb, ticks = 0.02, 0.02, 800
    speeds, motors = np.array([1.0, -0.4, 0.0, 0.0]), np.array([-0.07, 0.01, 0.05, -0.015])
    wheels = {"axes": WHEEL_AXES, "rotor_inertia": [spin], "coulomb": [coulomb]}
    settings = {
        "initial_joints_deg": [0.0] * 6,
        "friction": LOCKED,
        "base_actuation": "hardware",
        "wheels": {**wheels, "initial_speed": speeds.tolist()},
    }
    plant = Plant(rigid_robot(1e9, [1e12] * 3), PlantSettings.model_validate(settings), PERIOD)
    rates = (motors - coulomb * np.array([-1.0, -1.0, 1.0, 0.0])) / spin
    rates[0] = (motors[0] - coulomb) / spin
    through = (motors[0] + coulomb) / spin
    stops = -speeds[:2] / rates[:2]
    for tick in range(ticks):
        plant.step(Command(tick, np.concatenate([np.zeros(9), motors])))
        time = plant.tick * PERIOD
        first = speeds[0] + rates[0] * time if time < stops[0] else through * (time - stops[0])
        second = min(speeds[1] + rates[1] * time, 0.0)
        expected = [first, second, rates[2] * time, 0.0]
        np.testing.assert_allclose(plant.truth.wheel_velocities[:4], expected, atol=1e-10)
    assert stops.max() < time
    assert plant.truth.wheel_velocities[1] == plant.truth.wheel_velocities[3] == 0.0


def test_wheels_of_a_robot_with_passive_joints_get_what_is_asked_of_them() -> None:
    """Each one's own momentum grows by its motor's torque alone, whatever else moves.

    Also over a capture, which gives it none: ``J (Omega + a . w0)`` stays as the base is struck.
    """
    robot, rng = Robot.from_yaml(DATA / "passive_robot" / "robot.yaml"), np.random.default_rng(5)
    rotors = [rotor._replace(spin=0.05) for rotor in random_rotors(rng, robot, 4)]
    wheels = settings_of(rotors, initial_speed=[20.0, -30.0, 40.0, 10.0])
    axes, spins = np.array([rotor.axis for rotor in rotors]), np.array([r.spin for r in rotors])
    target = Target.from_dict(
        {
            "target": {
                "mass": 20.0,
                "inertia": [2.0, 3.0, 4.0, 0.0, 0.0, 0.0],
                "motion": {"velocity": [0.3, -0.2, 0.1], "angular_velocity": [0.2, 0.4, -0.3]},
            }
        }
    )
    settings = PlantSettings(
        initial_joints_deg=[10.0, 0.3, 20.0, 0.0, 30.0, 0.0],
        friction=SMOOTH,
        wheels=wheels,
        base_actuation="hardware",
        initial_quaternion=[0.5, -0.5, 0.1, 0.7],
        events=[f"capture@{100 * PERIOD}:{target.inline}"],
    )
    plant = Plant(robot, settings, PERIOD)

    def own() -> Array:
        truth = plant.truth
        return spins * (truth.wheel_velocities[:4] + axes @ truth.omega_base)

    torque = np.concatenate([np.zeros(3), 5.0 * rng.normal(size=6), 0.3 * rng.normal(size=4)])
    before, energy = own(), kinetic_energy(robot, plant.truth, wheels)
    assert energy == pytest.approx(0.5 * spins @ np.square(wheels.initial_speed))
    turned = 0.0
    for tick in range(200):
        omega = plant.truth.omega_base.copy()
        plant.step(Command(tick, torque))
        if plant.tick == 100:
            turned = float(np.abs(plant.truth.omega_base - omega).max())
        expected = before + torque[9:] * plant.tick * PERIOD
        np.testing.assert_allclose(own(), expected, rtol=0.0, atol=1e-11)
    assert turned > 1e-3, "the base must be struck"
    assert np.abs(plant.truth.passive_positions[:2]).max() > 1e-4
