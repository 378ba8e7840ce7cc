"""The plant against an adaptive integrator, the conservation laws, and its own contract."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from conservation import kinetic_energy, momentum
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import pinocchio_acceleration, pinocchio_model, rotation_of
from pydantic import ValidationError
from random_robots import State, random_quaternion, random_robot
from scipy.integrate import solve_ivp

from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.errors import DivergedError, InputError
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.environment.payload import PayloadSettings
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


def integrate_independently(
    robot: Robot, x: Array, torque: Array, begin: float, end: float, viscous: float, k: float
) -> Array:
    """DOP853 on Pinocchio's dynamics, quaternion rate by Hamilton's product, (61) as printed."""
    n = robot.n
    model = pinocchio_model(robot)
    data = model.createData()

    def derivative(t: float, x: Array) -> Array:
        q, rate = x[3:7] / np.linalg.norm(x[3:7]), x[13 + n :]
        state = State(q, x[7 : 7 + n], x[7 + n : 10 + n], x[10 + n : 13 + n], rate)
        pi = np.pi
        base = 0.010 * k * (np.sin(pi * t) + np.sin(1.5 * pi * t))
        inner = 0.005 * k * (np.sin(0.5 * pi * t) + np.sin(pi * t))
        outer = 0.002 * k * np.sin(0.5 * pi * t)
        disturbed = np.array([*[inner] * 3, *[outer] * n][:n])
        force = np.zeros(n + 6)
        force[3:6] = rotation_of(q).apply(torque[:3]) - base
        force[6:] = torque[3:] - disturbed - viscous * rate
        eps_rate = 0.5 * (q[0] * state.w0 + np.cross(state.w0, q[1:]))
        return np.concatenate(
            [
                state.v0,
                [-0.5 * q[1:] @ state.w0],
                eps_rate,
                rate,
                pinocchio_acceleration(model, data, state, force),
            ]
        )

    solution = solve_ivp(derivative, (begin, end), x, method="DOP853", rtol=1e-12, atol=1e-12)
    return solution.y[:, -1]


@pytest.mark.parametrize(("name", "gain"), [("paper_robot", 20.0), ("seven_joint_robot", 1.0)])
def test_step_agrees_with_an_adaptive_integrator(
    name: str, gain: float, request: pytest.FixtureRequest
) -> None:
    """0.2 s in four holds of torque, from a large attitude, disturbed (k = 3) and damped."""
    robot, rng = request.getfixturevalue(name), np.random.default_rng(2)
    n, hold, viscous = robot.n, 100, 0.2
    amplitude = gain * np.array([50.0] * 3 + [10.0] * (n - 3) + [2.0] * 3)
    plant = plant_of(
        robot,
        friction=FrictionSettings(coulomb=0.0, viscous=viscous),
        disturbance=DisturbanceSettings(scale=3.0),
        initial_joints_deg=rng.uniform(-180.0, 180.0, n).tolist(),
        initial_quaternion=random_quaternion(rng).tolist(),
    )
    expected = state_vector(plant.state)
    for stretch in range(4):
        torque = rng.normal(size=n + 3) * amplitude
        begin = stretch * hold * PERIOD
        end = begin + hold * PERIOD
        expected = integrate_independently(robot, expected, torque, begin, end, viscous, 3.0)
        fly(plant, np.tile(torque, (hold, 1)))
        actual = state_vector(plant.state)
        np.testing.assert_allclose(actual, expected, rtol=0.0, atol=1e-10 * np.abs(expected).max())
    assert np.abs(plant.state.joint_velocities).max() > 1.0, "the flight must be a lively one"


def test_integration_is_of_fourth_order() -> None:
    """Half the period, a sixteenth of the error."""
    rng = np.random.default_rng(3)
    robot = random_robot(rng, 3)
    torque = 60.0 * rng.normal(size=6)

    def end_state(steps: int) -> Array:
        plant = plant_of(robot, 0.4 / steps, initial_quaternion=[0.3, -0.8, 0.4, 0.2])
        return state_vector(fly(plant, np.tile(torque, (steps, 1))))

    exact = end_state(2560)
    errors = [np.abs(end_state(steps) - exact).max() for steps in (40, 80, 160)]
    for coarse, fine in pairwise(errors):
        assert 13.0 < coarse / fine < 19.0


@pytest.mark.parametrize("friction", [SMOOTH, FrictionSettings()], ids=["smooth", "friction"])
def test_momentum_is_conserved_over_10_s_of_violent_arm_motion(
    paper_robot: Robot, friction: FrictionSettings
) -> None:
    """Motors and friction are internal: what starts at rest keeps zero momentum.

    Also the quaternion stays unit, at every sample.
    """
    time = np.arange(20_000)[:, np.newaxis] * PERIOD
    amplitude = np.array([80.0, 100.0, 60.0, 12.0, 10.0, 5.0])
    frequency = np.array([0.31, 0.43, 0.37, 0.9, 1.1, 1.3])
    torques = np.zeros((20_000, 9))
    torques[:, 3:] = amplitude * np.cos(2.0 * np.pi * frequency * time)
    plant = plant_of(paper_robot, initial_joints_deg=START_DEG, friction=friction)
    fastest = np.zeros(6)
    for stretch in torques.reshape(100, 200, 9):
        state = fly(plant, stretch)
        linear, angular = momentum(paper_robot, state)
        assert np.abs(linear).max() < 1e-9
        assert np.abs(angular).max() < 1e-9
        assert abs(np.linalg.norm(state.quaternion) - 1.0) < 1e-15
        fastest = np.maximum(fastest, np.abs(state.joint_velocities))
    assert fastest.max() > 3.0, "joints must swing at several rad/s for this to mean much"
    assert plant.tick == 20_000


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


def test_angular_momentum_grows_by_the_base_torque_only(paper_robot: Robot) -> None:
    """The opposite case: a torque fixed in the turning base, integrated by Simpson's rule."""
    torque = np.array([5.0, -3.0, 4.0, 20.0, -10.0, 5.0, 1.0, 1.0, -1.0])
    plant = plant_of(paper_robot, initial_joints_deg=START_DEG)
    impulse, outer = np.zeros(3), rotation_of(plant.state.quaternion).apply(torque[:3])
    for _ in range(1000):
        middle = rotation_of(fly(plant, torque[np.newaxis]).quaternion).apply(torque[:3])
        last = rotation_of(fly(plant, torque[np.newaxis]).quaternion).apply(torque[:3])
        impulse += PERIOD / 3.0 * (outer + 4.0 * middle + last)
        outer = last
    linear, angular = momentum(paper_robot, plant.state)
    assert np.abs(linear).max() < 1e-10
    np.testing.assert_allclose(angular, impulse, rtol=1e-9)


@pytest.mark.parametrize("viscous", [0.0, 0.2])
def test_kinetic_energy_is_the_work_done(seven_joint_robot: Robot, viscous: float) -> None:
    """Power by Simpson's rule over two ticks of one torque; friction takes its share."""
    rng, n = np.random.default_rng(4), seven_joint_robot.n
    plant = plant_of(
        seven_joint_robot,
        friction=FrictionSettings(coulomb=0.0, viscous=viscous),
        initial_quaternion=[0.2, 0.9, -0.3, 0.25],
    )

    def power(torque: Array) -> float:
        state = plant.state
        actuators = torque[:3] @ state.omega_base + torque[3:] @ state.joint_velocities
        return float(actuators - viscous * state.joint_velocities @ state.joint_velocities)

    work, scale = 0.0, np.array([20.0] * 3 + [4.0] * (n - 3) + [0.5] * 3)
    for k in range(1000):
        torque = scale * np.cos(0.003 * k + np.arange(n + 3)) + 0.1 * rng.normal(size=n + 3)
        powers = [power(torque)]
        for _ in range(2):
            fly(plant, torque[np.newaxis])
            powers.append(power(torque))
        work += PERIOD / 3.0 * (powers[0] + 4.0 * powers[1] + powers[2])
    energy = kinetic_energy(seven_joint_robot, plant.state)
    assert energy > 1.0
    assert energy == pytest.approx(work, rel=1e-8)


@pytest.mark.parametrize("latency", [0, 1, 3])
def test_commands_are_applied_the_latency_later(paper_robot: Robot, latency: int) -> None:
    """Over tick k acts the command of k-D, nothing before the first; the state echoes it."""
    plant = plant_of(paper_robot, command_latency_ticks=latency)
    command = Command(0, np.zeros(9))
    for tick in range(10):
        command.tick, command.torque[:] = tick, tick + 1.0  # one array, as the nodes do
        plant.step(command)
        np.testing.assert_array_equal(plant.state.applied_torque, max(tick + 1.0 - latency, 0.0))


def test_late_commands_move_the_robot_as_prompt_ones_sent_later(paper_robot: Robot) -> None:
    torques = np.random.default_rng(5).normal(size=(20, 9))
    late = fly(plant_of(paper_robot, command_latency_ticks=4), torques)
    prompt = fly(plant_of(paper_robot), np.vstack([np.zeros((4, 9)), torques[:16]]))
    np.testing.assert_array_equal(state_vector(late), state_vector(prompt))


def test_torque_limits_clip_and_the_state_echoes_what_acted(paper_robot: Robot) -> None:
    """Not only the echo: the motion is that of the clipped torque."""
    wanted = np.array([9.0, -9.0, 1.0, 9.0, -9.0, 1.0, 4.0, -5.0, 0.0])
    clipped = np.array([2.0, -2.0, 1.0, 4.0, -4.0, 1.0, 4.0, -4.0, 0.0])
    limited = plant_of(paper_robot, base_torque_limit=2.0, joint_torque_limit=4.0)
    state = fly(limited, np.tile(wanted, (5, 1)))
    np.testing.assert_array_equal(state.applied_torque, clipped)
    free = fly(plant_of(paper_robot), np.tile(clipped, (5, 1)))
    np.testing.assert_array_equal(state_vector(state), state_vector(free))


def test_a_limit_of_zero_is_no_limit(paper_robot: Robot) -> None:
    wanted = np.linspace(-1e3, 1e3, 9)
    state = fly(plant_of(paper_robot), wanted[np.newaxis])
    np.testing.assert_array_equal(state.applied_torque, wanted)


def test_plant_starts_at_rest_where_it_is_told(paper_robot: Robot) -> None:
    """The quaternion is normalised, degrees become radians."""
    quaternion = [2.0, 0.0, -2.0, 0.0]
    plant = plant_of(paper_robot, initial_joints_deg=START_DEG, initial_quaternion=quaternion)
    state = plant.state
    assert (plant.tick, state.tick) == (0, 0)
    np.testing.assert_allclose(np.degrees(state.joint_positions), START_DEG)
    np.testing.assert_allclose(state.quaternion, [np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0])
    assert kinetic_energy(paper_robot, state) == 0.0


def test_payload_slows_the_wrist_down(paper_robot: Robot) -> None:
    """The plant flies the loaded robot, not the nominal one it was given."""
    payload = PayloadSettings(mass=20.0, inertia=[1.8, 1.0, 1.6, 0.0, 0.0, 0.0])
    loaded = plant_of(paper_robot, payload=payload)
    assert loaded.robot.mass[-1] == 20.0
    torque = np.eye(9)[8:]
    rates = [fly(p, torque).joint_velocities[5] for p in (plant_of(paper_robot), loaded)]
    assert rates[0] > 1.5 * rates[1] > 0.0


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


def test_initial_configuration_must_fit_the_robot(paper_robot: Robot) -> None:
    with pytest.raises(InputError, match=r"initial_joints_deg has 5 values.*'paper' has 6 joints"):
        plant_of(paper_robot, initial_joints_deg=[0.0] * 5)
    with pytest.raises(InputError, match="initial_quaternion must have a norm of"):
        plant_of(paper_robot, initial_quaternion=[0.0] * 4)


@pytest.mark.parametrize(
    "settings",
    [{"command_latency_ticks": -1}, {"joint_torque_limit": -1.0}, {"initial_quaternion": [1.0]}],
)
def test_settings_refuse_what_makes_no_sense(settings: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match=next(iter(settings))):
        PlantSettings(**settings)
