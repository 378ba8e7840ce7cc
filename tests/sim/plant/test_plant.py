"""The plant against an adaptive integrator, the conservation laws, and its own contract."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import assert_close, rotation_of
from oracles.momenta import kinetic_energy, momentum
from oracles.rotors import RotorEquations
from pydantic import ValidationError
from strategies import random_quaternion, random_robot

from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.errors import DivergedError, InputError
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.plant.plant import Plant, PlantSettings
from space_robot_sim.plant.tick import fastest_rate

Array = NDArray[np.float64]
PERIOD = 5e-4
SMOOTH = FrictionSettings(coulomb=0.0, viscous=0.0)
START_DEG = [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]


def plant_of(robot: Robot, period: float = PERIOD, **settings: Any) -> Plant:
    settings = {"initial_joints_deg": [30.0] * robot.n, "friction": SMOOTH, **settings}
    return Plant(robot, PlantSettings(**settings), period)


def fly(plant: Plant, torques: Array) -> RobotState:
    for tick, torque in enumerate(torques):
        plant.step(Command(tick, torque))
    return plant.state


def state_vector(state: RobotState) -> Array:
    """``[r0, quaternion, theta, v0, w0, thetadot]``, velocities on inertial axes."""
    omega = rotation_of(state.quaternion).apply(state.omega_base)
    return np.concatenate(
        [
            state.base_position,
            state.quaternion,
            state.joint_positions,
            state.base_velocity,
            omega,
            state.joint_velocities,
        ]
    )


@pytest.mark.parametrize(("name", "gain"), [("paper_robot", 20.0), ("seven_joint_robot", 1.0)])
def test_step_agrees_with_an_adaptive_integrator(
    name: str, gain: float, request: pytest.FixtureRequest
) -> None:
    """0.2 s in four holds of torque, from a large attitude, disturbed (k = 3) and damped.

    DOP853 on Pinocchio's dynamics, (61) as printed.
    """
    robot, rng = request.getfixturevalue(name), np.random.default_rng(2)
    n, hold, viscous, k = robot.n, 100, 0.2, 3.0
    amplitude = gain * np.array([50.0] * 3 + [10.0] * (n - 3) + [2.0] * 3)
    plant = plant_of(
        robot,
        friction=FrictionSettings(coulomb=0.0, viscous=viscous),
        disturbance=DisturbanceSettings(scale=k),
        initial_joints_deg=rng.uniform(-180.0, 180.0, n).tolist(),
        initial_quaternion=random_quaternion(rng).tolist(),
    )
    equations, expected = RotorEquations(robot), state_vector(plant.state)
    for stretch in range(4):
        torque = rng.normal(size=n + 3) * amplitude

        def force(t: float, x: Array, torque: Array = torque) -> Array:
            a, b, c = (np.sin(share * np.pi * t) for share in (0.5, 1.0, 1.5))
            base, inner, outer = 0.010 * k * (b + c), 0.005 * k * (a + b), 0.002 * k * a
            disturbed = np.array([*[inner] * 3, *[outer] * n][:n])
            of_base = rotation_of(x[3:7]).apply(torque[:3]) - base
            joints = torque[3:] - disturbed - viscous * x[13 + n :]
            return np.concatenate([np.zeros(3), of_base, joints])

        begin, end = stretch * hold * PERIOD, (stretch + 1) * hold * PERIOD
        expected = equations.fly(expected, begin, end, force).y[:, -1]
        fly(plant, np.tile(torque, (hold, 1)))
        assert_close(state_vector(plant.state), expected, 1e-10)
    assert np.abs(plant.state.joint_velocities).max() > 1.0, "the flight must be a lively one"


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
    """The quaternion is normalised, degrees become radians."""
    quaternion = [2.0, 0.0, -2.0, 0.0]
    plant = plant_of(paper_robot, initial_joints_deg=START_DEG, initial_quaternion=quaternion)
    state = plant.state
    assert (plant.tick, state.tick) == (0, 0)
    np.testing.assert_allclose(np.degrees(state.joint_positions), START_DEG)
    np.testing.assert_allclose(state.quaternion, [np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0])
    assert kinetic_energy(paper_robot, state) == 0.0


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


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"initial_joints_deg": [0.0] * 5}, "has 5 values.*'paper' has 6 joints"),
        ({"initial_quaternion": [0.0] * 4}, "initial_quaternion must have a norm of"),
        ({"command_latency_ticks": -1}, "command_latency_ticks"),
        ({"joint_torque_limit": -1.0}, "joint_torque_limit"),
        ({"initial_quaternion": [1.0]}, "initial_quaternion"),
    ],
)
def test_settings_that_make_no_sense_are_refused(
    paper_robot: Robot, settings: dict[str, Any], said: str
) -> None:
    with pytest.raises((InputError, ValidationError), match=said):
        plant_of(paper_robot, **settings)
