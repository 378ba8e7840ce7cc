"""Sensors that fail for a while: how much, when, and that the truth stays."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import rotation_of
from random_samples import assert_same
from sensor_bench import Bench, a_state

from space_robot_msgs_py.samples import ACTUATOR_FIELDS, ALL_FIELDS, PASSIVE_FIELDS, RobotState
from space_robot_sim.faults.schedule import BLOCK_TICKS

Array = NDArray[np.float64]

SEEDS = st.integers(0, 2**31 - 1)
FIELDS = {
    "gyro": "omega_base",
    "joint_position": "joint_positions",
    "joint_velocity": "joint_velocities",
}
UNMEASURED = ("applied_torque", "wheel_torques", "thrusts")
"""Not the sensors' affair."""
REPORTED = [name for name in ALL_FIELDS if name not in UNMEASURED]


def changed(measured: RobotState, state: RobotState) -> set[str]:
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
    assert changed(measured, state) == set()
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
        assert changed(measured, state) == ({field} if 10 <= tick < 20 else set())
        assert_same(state, a_state(tick))


def check_white(errors: Array, sigma: float) -> None:
    """Mean, deviation, no correlation of axes or of ticks; five sigma bounds."""
    bound = 5.0 / np.sqrt(len(errors))
    assert np.abs(errors.mean(axis=0)).max() < bound * sigma
    assert np.abs(errors.std(axis=0) / sigma - 1.0).max() < bound
    assert np.abs(np.corrcoef(errors.T) - np.eye(errors.shape[1])).max() < bound
    assert np.abs((errors[1:] * errors[:-1]).mean(axis=0)).max() < bound * sigma**2


@pytest.mark.parametrize(("name", "field"), FIELDS.items())
def test_noise_has_its_standard_deviation(name: str, field: str) -> None:
    state = a_state()
    seen = Bench(f"noise_{name}@0:2e-3").watch(state, 4000, field)
    check_white(seen - getattr(state, field), 2e-3)


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
        bench = Bench(seed=seed)
        for block in range(3):
            bench.measure(a_state(BLOCK_TICKS * block + 7))
            assert bench.block["drawn"] == block
            for name in ("star_tracker", "gyro", "encoders"):
                rows.append(bench.block[name]["draws"].ravel()[: 3 * BLOCK_TICKS].copy())
    found = np.corrcoef(rows) - np.eye(len(rows))
    assert np.abs(found).max() < 5.0 / np.sqrt(rows[0].size)


def test_quantisation_comes_after_noise_whatever_the_order_given() -> None:
    bench = Bench("quantise_gyro@0:0.5", "noise_gyro@0:0.3")
    values = bench.measure(a_state(0)).omega_base
    np.testing.assert_array_equal(values, 0.5 * np.round(values / 0.5))
