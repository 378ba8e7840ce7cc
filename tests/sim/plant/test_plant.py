"""The plant: a tree and wheels against SciPy and formulas, momenta, and its own contract."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from benches import WHEEL_AXES
from hypothesis import given
from hypothesis import strategies as st
from oracles import assert_close, rotation_of
from oracles.momenta import kinetic_energy, momentum, state_of
from oracles.rotors import RotorEquations, flown_settings, random_motor_rotors, random_rotors
from robots import ANGLES_DEG, LOCKED, NO_FRICTION, PERIOD, plant_numbers, rigid_robot
from strategies import random_gears, random_quaternion, random_robot, random_tree, with_gears

from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.errors import DivergedError
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.disturbance_table import DisturbanceTable
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.environment.target import Target
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantSettings
from space_robot_sim.plant.tick import fastest_rate


def plant_of(robot: Robot, **settings: Any) -> Plant:
    settings = {"initial_joints_deg": [30.0] * robot.n, "friction": NO_FRICTION, **settings}
    return Plant(robot, PlantSettings(**settings), PERIOD)


def fly(plant: Plant, torques: Array) -> RobotState:
    for torque in torques:
        plant.step(Command(plant.tick, torque))
    return plant.state


@given(
    rate_deg_s=st.lists(st.floats(-50.0, 50.0), min_size=3, max_size=3),
    seed=st.integers(0, 2**31 - 1),
)
def test_a_start_with_a_rate_turns_the_robot_about_its_centre_of_mass(
    paper_robot: Robot, rate_deg_s: list[float], seed: int
) -> None:
    """As one body: no linear momentum, no joint moves; and free of torque both momenta stay."""
    rng = np.random.default_rng(seed)
    settings = {
        "initial_joints_deg": rng.uniform(-180.0, 180.0, 6).tolist(),
        "initial_quaternion": random_quaternion(rng).tolist(),
    }
    plant = plant_of(paper_robot, initial_rate_deg_s=rate_deg_s, **settings)
    state = plant.truth
    np.testing.assert_allclose(np.degrees(state.omega_base), rate_deg_s, rtol=0.0, atol=1e-13)
    assert not state.joint_velocities.any()
    linear, angular = momentum(paper_robot, state)
    assert np.abs(linear).max() < 1e-10
    assert np.array_equal(plant.state.omega_base, state.omega_base)
    fly(plant, np.zeros((10, 9)))
    later = momentum(paper_robot, plant.state)
    np.testing.assert_allclose(later[0], 0.0, atol=1e-9)
    np.testing.assert_allclose(later[1], angular, rtol=1e-9, atol=1e-9)


def test_plant_starts_at_rest_where_it_is_told(paper_robot: Robot) -> None:
    """The quaternion is normalised, degrees become radians; of a joint not told they are 0."""
    start = {"initial_joints_deg": ANGLES_DEG, "initial_quaternion": [2.0, 0.0, -2.0, 0.0]}
    plant = plant_of(paper_robot, **start)
    state = plant.state
    assert (plant.tick, state.tick) == (0, 0)
    np.testing.assert_allclose(np.degrees(state.joint_positions), ANGLES_DEG)
    np.testing.assert_allclose(state.quaternion, [np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0])
    assert kinetic_energy(paper_robot, state) == 0.0
    one_joint = random_robot(np.random.default_rng(1), 1)
    assert Plant(one_joint, PlantSettings(), PERIOD).state.joint_positions == 0.0


@pytest.mark.parametrize(
    ("torque", "why"), [(np.nan, "not finite"), (1e300, "finite|rad/s"), (1e9, "rad/s")]
)
def test_divergence_is_an_error_with_its_tick(paper_robot: Robot, torque: float, why: str) -> None:
    plant = plant_of(paper_robot)
    fly(plant, np.zeros((7, 9)))
    with pytest.raises(DivergedError, match=why) as caught:
        fly(plant, np.full((5, 9), torque))
    assert caught.value.tick == plant.tick == 8
    assert "tick 8 (t = 0.0040 s)" in str(caught.value)


@pytest.mark.parametrize("saved_at", [3, 250, 330])
def test_a_plant_that_goes_back_flies_the_same_bits_again(
    paper_robot: Robot, saved_at: int
) -> None:
    """Over blocks of noise, faults that begin and end, late commands and a capture."""
    target = '{"mass": 9.0, "inertia": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]}'
    plant = plant_of(
        paper_robot,
        friction=FrictionSettings(),
        command_latency_ticks=3,
        fault_seed=4,
        gyro={"angle_random_walk": 1e-3, "rate_random_walk": 1e-2},
        encoders={"noise": 1e-3},
        star_tracker={"noise_across": 1e-3, "rate": 100.0, "delay": 0.02},
        faults=["stuck_joint@0.1-0.135:2=9", "noise_gyro@0.14-0.16:1", "saturate_joints@0.13:0.3"],
        events=[f"capture@0.14:{target}"],
    )
    torques = np.random.default_rng(1).normal(size=(600, 9))

    def flown(begin: int, end: int) -> Array:
        rows = []
        for tick in range(begin, end):
            plant.step(Command(tick, torques[tick]))
            rows.append(np.concatenate([plant.state.numbers, plant.truth.numbers]))
        return np.array(rows)

    flown(0, saved_at)
    saved = plant.save()
    first, mass = flown(saved_at, 600), plant.robot.mass.sum()
    for _ in range(2):
        plant.restore(saved)
        assert plant.tick == saved_at
        np.testing.assert_array_equal(flown(saved_at, 600), first)
        assert plant.robot.mass.sum() == mass


@given(st.integers(0, 2**32 - 1), st.integers(0, 4))
def test_the_fastest_rate_is_of_base_joints_and_wheels(seed: int, wheels: int) -> None:
    """And NaN if any of them is; how fast the base drifts does not count."""
    rng, n = np.random.default_rng(seed), 3
    model, x = random_robot(rng, n).model.copy(), rng.normal(size=13 + 2 * n + wheels + 2)
    assign(model, wheel_count=wheels)
    rates = x[10 + n : 13 + 2 * n + wheels]
    x[: 10 + n] *= 1e3
    x[x.size - 2 :] = np.nan  # behind the last wheel
    assert fastest_rate(model, x) == np.abs(rates).max()
    rates[rng.integers(rates.size)] = np.nan
    assert np.isnan(fastest_rate(model, x))


KINDS = (
    *("revolute", "prismatic", "revolute", "fixed"),
    *("passive revolute", "passive prismatic", "passive revolute", "fixed"),
)
TORQUE = np.array([60.0, -40.0, 50.0, 4.0, 9.0, -6.0])


def tree(rng: np.random.Generator) -> Robot:
    """Turning, sliding and passive joints, some with gears."""
    robot = random_gears(rng, Robot.from_tree(random_tree(rng, KINDS)))
    return with_gears(robot, [gear and gear._replace(ratio=10.0) for gear in robot.gears])


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_flight_is_the_one_that_scipy_integrates(seed: int) -> None:
    """0.2 s in two holds of torque: springs with damping, friction of the robot's own, gears.

    Base and joints are disturbed by sines; force and torque on the base, on its own axes, and a
    joint by lines of a table.
    """
    rng, viscous = np.random.default_rng(seed), 0.2
    robot = tree(rng)
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
    plant = plant_of(
        robot,
        friction=friction,
        disturbance=disturbance,
        substeps=4,
        initial_joints_deg=[0.0, 0.3, 0.6],
        initial_quaternion=[0.3, -0.8, 0.4, 0.2],
    )
    equations, own = (
        RotorEquations(robot, random_motor_rotors(rng, robot)),
        np.array(robot.friction)[:, 1],
    )
    geared = equations.joints
    usual = np.where(np.arange(robot.joint_count) < n, viscous, 0.0)
    damping = np.where(np.isnan(own), usual, own)
    for k, spring in enumerate(robot.springs):
        damping[n + k] += spring.damping
    expected = plant_numbers(plant)
    for begin, torque in ((0.0, TORQUE), (hold, -0.5 * TORQUE[::-1])):

        def force(t: float, x: Array, torque: Array = torque) -> Array:
            theta, rates, motor_rates, _ = equations.parts(x)
            acting, pushed = ((1.0 - t / end) * w[0] + t / end * w[1] for w in (wrench, push))
            of_base = rotation_of(x[3:7] / np.linalg.norm(x[3:7]))
            joints = -damping * rates
            joints[:n] += torque[3:]
            joints[geared] = 0.0
            joints[:n] -= 3.0 * np.sin(6.0 * np.pi * t)
            joints[1] += pushed
            for k, spring in enumerate(robot.springs):
                joints[n + k] -= spring.stiffness * (theta[n + k] - spring.rest)
            turning = of_base.apply(torque[:3] + acting[3:]) - 30.0 * np.sin(3.0 * np.pi * t)
            motors = torque[3:][geared] - damping[geared] * motor_rates
            return np.concatenate([of_base.apply(acting[:3]), turning, joints, motors])

        expected = equations.fly(expected, begin, begin + hold, force).y[:, -1]
        fly(plant, np.tile(torque, (200, 1)))
        assert_close(plant_numbers(plant), expected, 1e-9)
    assert np.abs(plant.truth.passive_velocities[:3]).max() > 0.01, "springs must swing"
    deflections = expected[-len(geared) :] - plant.truth.joint_positions[geared]
    assert np.abs(deflections).max() > 1e-4, "those of gears, too"


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


def test_a_capture_gives_no_wheel_and_no_rotor_a_momentum_of_its_own() -> None:
    """``J (N thetadot_m + z . w_p)`` is as in the flight without it, though all else is struck.

    Each wheel's own momentum, ``J (Omega + a . w0)``, grows by its motor's torque alone.
    """
    rng, capture = np.random.default_rng(1), 100
    robot = tree(rng)
    equations = RotorEquations(robot, random_motor_rotors(rng, robot))
    rotors = [rotor._replace(spin=0.05) for rotor in random_rotors(rng, robot, 4)]
    axes, inertia = np.array([rotor.axis for rotor in rotors]), 0.05
    motion = {"velocity": [0.3, -0.2, 0.1], "angular_velocity": [0.2, 0.4, -0.3]}
    content = {"mass": 20.0, "inertia": [2.0, 3.0, 4.0, 0.0, 0.0, 0.0], "motion": motion}
    target = Target.from_dict({"target": content})
    torque = np.concatenate([np.zeros(3), 20.0 * rng.normal(size=3), 0.3 * rng.normal(size=4)])
    speeds, spins = [], []
    for events in ([], [f"capture@{capture * PERIOD}:{target.inline}"]):
        plant = plant_of(
            robot,
            wheels=flown_settings(rotors, initial_speed=[20.0, -30.0, 40.0, 10.0]),
            base_actuation="hardware",
            substeps=2,
            events=events,
        )
        own = []
        for _ in range(2 * capture):
            truth = plant.truth
            own.append(inertia * (truth.wheel_velocities[:4] + axes @ truth.omega_base))
            fly(plant, torque[np.newaxis])
            if plant.tick == capture:
                state, found = (
                    state_of(robot, plant.truth),
                    equations.velocity(plant_numbers(plant)),
                )
                mass, _ = equations.matrices(state.quaternion, state.theta, np.zeros(found.size))
                speeds.append(found)
                spins.append((mass @ found)[6 + robot.joint_count :])
        grown = np.outer(np.arange(2 * capture) * PERIOD, torque[6:])
        np.testing.assert_allclose(own - own[0], grown, rtol=0.0, atol=1e-11)
    assert np.abs(speeds[1] - speeds[0])[[*range(6), -1]].max() > 1e-3
    np.testing.assert_allclose(spins[1], spins[0], rtol=0.0, atol=1e-12 * np.abs(spins[0]).max())
