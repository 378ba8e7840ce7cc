"""Encoders at motors and links; sensors that fail for a while: how much, and when."""

from __future__ import annotations

import numpy as np
import pytest
from benches import PERIOD, N, a_state
from benches import SensorBench as Bench
from hypothesis import given
from hypothesis import strategies as st
from oracles import rotation_of
from random_samples import assert_same
from robots import GearedFlight
from scipy.stats import kstest
from strategies import SEEDS, random_robot, rotor_room, with_gears

from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.sensors import EncoderSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Encoder, Gear
from space_robot_msgs_py.samples import ACTUATOR_FIELDS, ALL_FIELDS, PASSIVE_FIELDS, RobotState
from space_robot_sim.component import Installation
from space_robot_sim.faults.schedule import BLOCK_TICKS
from space_robot_sim.sensors.encoders import Encoders


def moving(tick: int, period: float = PERIOD) -> RobotState:
    """Joints that leave rest at tick 0, each at its own rate."""
    state = RobotState.allocate(N)
    state.tick = tick
    state.joint_velocities[:] = 0.1 + 0.01 * np.arange(N)
    state.joint_positions[:] = 1.0 + state.joint_velocities * tick * period
    return state


@pytest.mark.parametrize("bits", [0, 12])
def test_the_step_of_a_joint_that_slides_is_a_share_of_a_metre(bits: int) -> None:
    """Beside joints that turn, in the step and in what is told at rest."""
    slides, settings = np.arange(N) % 3 == 1, EncoderSettings(bits=bits)
    rest = a_state().block[0]
    encoders = Encoders.build(settings, Installation(N, PERIOD, rest, is_prismatic=slides))
    step = np.where(slides, 1.0, 2.0 * np.pi) / 2**bits if bits else np.zeros(N)
    np.testing.assert_array_equal(encoders.step, step)
    told = encoders.history[0]
    if bits:
        np.testing.assert_allclose(told / step, np.round(told / step), atol=1e-9)
    assert (np.abs(told - rest.joint_positions) <= 0.5 * step * (1.0 + 1e-9)).all()


def test_noise_of_angles_and_of_measured_rates() -> None:
    state = a_state()
    bench = Bench(encoders={"noise": 1e-3, "velocity_noise": 2e-2})
    angles = bench.watch(state, 4000, "joint_positions") - state.joint_positions
    assert angles.std(axis=0) == pytest.approx(1e-3, rel=0.06)
    bench = Bench(encoders={"noise": 1e-3, "velocity_noise": 2e-2})
    rates = bench.watch(state, 4000, "joint_velocities") - state.joint_velocities
    assert rates.std(axis=0) == pytest.approx(2e-2, rel=0.06)
    assert np.abs(np.mean(angles * rates) / 2e-5) < 5.0 / np.sqrt(angles.size)


@pytest.mark.parametrize(("lag", "period"), [(1, 5e-4), (10, 3e-3), (256, 5e-4)])
def test_differenced_rates(lag: int, period: float) -> None:
    """The mean rate over the time; at rest before tick 0."""
    bench = Bench(truth=moving(0), period=period, encoders={"difference_ticks": lag})
    for tick in range(lag + 300):
        state = moving(tick, period)
        told = bench.measure(state).joint_velocities
        share = min(1.0, tick / lag)
        np.testing.assert_allclose(told, share * state.joint_velocities, atol=1e-9)


def test_rates_have_steps_of_their_own() -> None:
    told = Bench(encoders={"velocity_step": 0.25}).measure(a_state()).joint_velocities
    np.testing.assert_array_equal(told, 0.25 * np.floor(a_state().joint_velocities / 0.25 + 0.5))


@pytest.mark.parametrize("lag", [0, 4])
def test_a_stuck_encoder_stands_and_comes_back(lag: int) -> None:
    """Without noise too, at no rate; the others go on."""
    settings = {"noise": 1e-3, "velocity_noise": 1e-3, "difference_ticks": lag}
    bench = Bench("encoder_stuck@0.005-0.01:2", truth=moving(0), encoders=settings)
    rows = []
    for tick in range(30):
        told = bench.measure(moving(tick))
        rows.append([told.joint_positions[:3].copy(), told.joint_velocities[:3].copy()])
    angles, rates = np.array(rows).transpose(1, 0, 2)
    stands = np.diff(angles[:, 1]) == 0.0
    np.testing.assert_array_equal(np.flatnonzero(stands) + 1, range(10, 20))
    np.testing.assert_array_equal(np.flatnonzero(rates[:, 1] == 0.0), range(10, 20))
    assert (np.diff(angles[:, [0, 2]], axis=0) != 0.0).all()
    assert abs(angles[20, 1] - moving(20).joint_positions[1]) < 5e-3


SUBSTEPS = 2
SIDES: tuple[Encoder | None, ...] = ("link", "motor", None, "both", "motor", None)
"""Of each joint's encoder; None: the joint has no gear."""
AT_MOTORS = {1: 2, 4: 4}
"""Number of the motor that is measured, by joint."""
TORQUE = np.array([3.0, -2.0, 1.0, 20.0, -15.0, 10.0, 12.0, -8.0, 5.0])


def geared(sides: tuple[Encoder | None, ...] = SIDES) -> Robot:
    robot = random_robot(np.random.default_rng(8), N)
    gears = [
        Gear(0.02 * rotor_room(robot, joint), 10.0, 400.0, 0.5, side or "link")
        for joint, side in enumerate(sides)
    ]
    has_gear = [bool(side) for side in SIDES]
    return with_gears(
        robot, [gear if has else None for gear, has in zip(gears, has_gear, strict=True)]
    )


def test_ideal_encoders_tell_motor_or_link_to_the_bit() -> None:
    flight = GearedFlight(geared(), SUBSTEPS, initial_joints_deg=[10.0 * k for k in range(N)])
    for tick in range(50):
        if tick:
            flight.fly(TORQUE)
        state, truth = flight.plant.state, flight.plant.truth
        positions, velocities = truth.joint_positions.copy(), truth.joint_velocities.copy()
        for joint, motor in AT_MOTORS.items():
            positions[joint] = truth.motor_positions[motor - 1]
            velocities[joint] = truth.motor_velocities[motor - 1]
        np.testing.assert_array_equal(state.joint_positions, positions)
        np.testing.assert_array_equal(state.joint_velocities, velocities)
        for name in ("motor_positions", "motor_velocities", "omega_base", "applied_torque"):
            np.testing.assert_array_equal(getattr(state, name), getattr(truth, name), name)
    deflection = np.abs(positions - truth.joint_positions)
    assert deflection[[1, 4]].min() > 1e-5
    assert not deflection[[0, 2, 3, 5]].any()


@pytest.mark.parametrize("side", ["motor", "link", "both"])
def test_only_with_encoders_at_motors_the_measured_state_is_not_the_true_one(side: Encoder) -> None:
    flight = GearedFlight(geared((side,) * N), SUBSTEPS)
    assert flight.plant.measures_truth == (side != "motor")
    state, truth = flight.plant.state, flight.plant.truth
    np.testing.assert_array_equal(state.numbers, truth.numbers)  # at rest nothing is stretched


FIELDS = {
    "gyro": "omega_base",
    "joint_position": "joint_positions",
    "joint_velocity": "joint_velocities",
}
UNMEASURED = ("applied_torque", "wheel_torques", "thrusts")
"""Not the sensors' affair."""
REPORTED = [name for name in ALL_FIELDS if name not in UNMEASURED]


def fields_changed(measured: RobotState, state: RobotState) -> set[str]:
    return {n for n in REPORTED if (getattr(measured, n) != getattr(state, n)).any()}


@pytest.mark.parametrize("are_ideal", [True, False])
def test_sound_sensors_tell_the_truth_in_arrays_of_their_own(are_ideal: bool) -> None:
    """But for the torques, which they do not measure; what has no sensor is told as it is."""
    state, bench, rng = a_state(7), Bench(), np.random.default_rng(3)
    bench.block["are_ideal"] = are_ideal
    for name in (*ACTUATOR_FIELDS, *PASSIVE_FIELDS):
        values = getattr(state, name)
        values[:] = rng.normal(size=values.size)
    truth = state.copy()
    measured = bench.measure(state)
    assert fields_changed(measured, state) == set()
    assert not any(getattr(measured, name).any() for name in UNMEASURED)
    measured.block[:] = 9.0
    np.testing.assert_array_equal(state.numbers, truth.numbers)


@pytest.mark.parametrize("kind", ["noise", "quantise"])
@pytest.mark.parametrize(
    ("name", "field"), [*FIELDS.items(), ("attitude", "quaternion")], ids=lambda v: str(v)
)
def test_only_the_quantity_named_changes_and_only_in_time(kind: str, name: str, field: str) -> None:
    bench = Bench(f"{kind}_{name}@0.005-0.01:0.3")
    for tick in range(30):
        state = a_state(tick)
        measured = bench.measure(state)
        assert fields_changed(measured, state) == ({field} if 10 <= tick < 20 else set())
        assert_same(state, a_state(tick))


def check_white(errors: Array, sigma: float) -> None:
    """Mean, deviation, no correlation of axes or of ticks; five sigma bounds."""
    bound = 5.0 / np.sqrt(len(errors))
    assert np.abs(errors.mean(axis=0)).max() < bound * sigma
    assert np.abs(errors.std(axis=0) / sigma - 1.0).max() < bound
    assert np.abs(np.corrcoef(errors.T) - np.eye(errors.shape[1])).max() < bound
    assert np.abs((errors[1:] * errors[:-1]).mean(axis=0)).max() < bound * sigma**2


def test_attitude_noise_is_a_small_rotation_of_its_standard_deviation() -> None:
    state = a_state()
    seen = Bench("noise_attitude@0:1e-3").watch(state, 4000, "quaternion")
    assert np.abs(np.linalg.norm(seen, axis=1) - 1.0).max() < 1e-14
    assert (seen @ state.quaternion).min() > 0.99, "the quaternion's sign does not flip"
    truth = rotation_of(state.quaternion)
    check_white(np.array([(truth.inv() * rotation_of(q)).as_rotvec() for q in seen]), 1e-3)


def test_noise_adds_in_quadrature_to_that_of_the_sensor_and_of_other_faults() -> None:
    state = a_state()
    faults = ("noise_gyro@0:2e-3", "noise_gyro@0:4e-3", "noise_attitude@0:3e-3")
    bench = Bench(
        *faults, gyro={"noise": 4e-3}, star_tracker={"noise_across": 4e-3, "noise_about": 4e-3}
    )
    check_white(bench.watch(state, 4000, "omega_base") - state.omega_base, 6e-3)
    np.testing.assert_allclose(bench.block[0].star_tracker.sigma, 5e-3)


@given(SEEDS, st.floats(1e-9, 1.0))
def test_a_quantised_attitude_is_unit_and_near(seed: int, step: float) -> None:
    """Off by at most a quarter of a step a number of the quaternion: one step in all."""
    state = a_state(0, seed)
    measured = Bench(f"quantise_attitude@0:{step!r}", truth=state).measure(state).quaternion
    assert abs(np.linalg.norm(measured) - 1.0) < 1e-14
    error = (rotation_of(state.quaternion).inv() * rotation_of(measured)).magnitude()
    assert error < 1.1 * step + 1e-12
    numbers = measured / np.abs(measured).max()
    whole = np.round(2.0 * np.abs(state.quaternion).max() / step)  # of the largest number
    steps = numbers * whole
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-6 if step > 1e-6 else 1.0)


@given(SEEDS, st.floats(1e-9, 10.0), st.sampled_from(list(FIELDS)))
def test_quantised_numbers_are_whole_steps_and_within_half_a_one(
    seed: int, step: float, name: str
) -> None:
    state = a_state(0, seed)
    values = getattr(Bench(f"quantise_{name}@0:{step!r}").measure(state), FIELDS[name])
    np.testing.assert_array_equal(values, step * np.round(values / step))
    assert np.abs(values - getattr(state, FIELDS[name])).max() <= 0.5 * step * (1.0 + 1e-6)


def test_the_coarser_step_counts() -> None:
    bench = Bench("quantise_joint_position@0-0.001:0.1", encoders={"bits": 8})
    state, seen = a_state(), []
    for state.tick in range(4):
        bench.measure(state)
        seen.append(bench.block[0].encoders.step[0])
    assert seen == [0.1, 0.1, *[2.0 * np.pi / 256] * 2]


def test_draws_depend_on_seed_and_tick_alone() -> None:
    """Not on when the fault began, nor on the faults of other sensors."""
    one = Bench("noise_gyro@0:0.1")
    other = Bench("noise_attitude@0:0.2", "noise_gyro@0.05:0.1", "noise_joint_position@0:1")
    for tick in (*range(0, 300), 1000):
        first, second = (bench.measure(a_state(tick)).omega_base for bench in (one, other))
        if tick >= 100:
            np.testing.assert_array_equal(first, second)
    fresh, seeded = Bench("noise_gyro@0:0.1"), Bench("noise_gyro@0:0.1", seed=1)
    np.testing.assert_array_equal(fresh.measure(a_state(1000)).omega_base, first)
    assert (seeded.measure(a_state(1000)).omega_base != first).all()


def test_each_sensor_and_each_block_of_ticks_has_numbers_of_its_own() -> None:
    """Uncorrelated, of any two sensors, blocks and seeds."""
    rows = []
    for seed in (0, 1):
        bench = Bench(seed=seed, magnetometer={"noise": 1e-9})
        for block in range(3):
            bench.measure(a_state(BLOCK_TICKS * block + 7))
            assert bench.block["drawn"] == block
            for name in ("star_tracker", "gyro", "encoders", "magnetometer"):
                rows.append(bench.block[name]["draws"].ravel()[: 3 * BLOCK_TICKS].copy())
    found = np.corrcoef(rows) - np.eye(len(rows))
    assert np.abs(found).max() < 5.0 / np.sqrt(rows[0].size)


def test_a_magnetometer_has_normal_noise_about_its_bias_in_flight() -> None:
    """By Kolmogorov and Smirnov's test, axis by axis; a fault adds to the bias for a while."""
    bench = Bench(
        "magnetometer_bias@1:base_y=3e-6", magnetometer={"noise": 2e-7, "bias": [1e-6, 0.0, -2e-6]}
    )
    state = a_state()
    state.magnetic_field[:] = 1e-5, -2e-5, 3e-5
    errors = bench.watch(state, 4000, "magnetic_field") - state.magnetic_field
    errors[2000:, 1] -= 3e-6
    scores = (errors - [1e-6, 0.0, -2e-6]) / 2e-7
    check_white(scores, 1.0)
    assert all(kstest(column, "norm").pvalue > 1e-3 for column in scores.T)
