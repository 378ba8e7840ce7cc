"""Noisy, coarse and corrupted measurements: how much, when, and that the truth stays."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import rotation_of
from random_robots import random_quaternion
from random_samples import assert_same, random_sample

from space_robot_msgs_py.samples import STATE_FIELDS, Command, RobotState
from space_robot_sim.faults.corruption import STAMP_BACK_TICKS, STAMP_JUMP_TICKS, Corruption
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.faults.schedule import Schedule
from space_robot_sim.plant.faults import PLANT_KINDS
from space_robot_sim.sensors.faults import SensorFaults, rotation_vector, turned

Array = NDArray[np.float64]

PERIOD = 5e-4
N = 6
SEEDS = st.integers(0, 2**31 - 1)
FIELDS = {
    "gyro": "omega_base",
    "joint_position": "joint_positions",
    "joint_velocity": "joint_velocities",
}


def schedule(*texts: str, seed: int = 0) -> Schedule:
    return Schedule(parse_faults(texts, PLANT_KINDS), seed, PERIOD)


def sensors(*texts: str, seed: int = 0) -> SensorFaults:
    return SensorFaults(schedule(*texts, seed=seed), N)


def a_state(tick: int, seed: int = 1) -> RobotState:
    state = random_sample(N, seed, tick)
    state.quaternion[:] = random_quaternion(np.random.default_rng(seed))
    return state


def changed(measured: RobotState, state: RobotState) -> set[str]:
    names = list(STATE_FIELDS)
    return {n for n in names if (getattr(measured, n) != getattr(state, n)).any()}


def test_sound_sensors_tell_the_truth_in_arrays_of_their_own() -> None:
    state = a_state(7)
    measured = sensors().measure(state)
    assert_same(measured, state)
    assert measured.tick == 7
    measured.omega_base[:] = 9.0
    assert_same(state, a_state(7))


@pytest.mark.parametrize("kind", ["noise", "quantise"])
@pytest.mark.parametrize(
    ("name", "field"), [*FIELDS.items(), ("attitude", "quaternion")], ids=lambda v: str(v)
)
def test_only_the_quantity_named_changes_and_only_in_time(kind: str, name: str, field: str) -> None:
    faulty = sensors(f"{kind}_{name}@0.005-0.01:0.3")
    for tick in range(30):
        state = a_state(tick)
        measured = faulty.measure(state)
        assert changed(measured, state) == ({field} if 10 <= tick < 20 else set())
        assert_same(state, a_state(tick))


@pytest.mark.parametrize(("name", "field"), FIELDS.items())
def test_noise_has_its_standard_deviation(name: str, field: str) -> None:
    """Over 4000 ticks: mean, deviation, no correlation of axes or of ticks; five sigma bounds."""
    faulty, state, ticks, sigma = sensors(f"noise_{name}@0:2e-3"), a_state(0), 4000, 2e-3
    errors = np.empty((ticks, getattr(state, field).size))
    for tick in range(ticks):
        state.tick = tick
        errors[tick] = getattr(faulty.measure(state), field) - getattr(state, field)
    bound = 5.0 / np.sqrt(ticks)
    assert np.abs(errors.mean(axis=0)).max() < bound * sigma
    assert np.abs(errors.std(axis=0) / sigma - 1.0).max() < bound
    axes = np.corrcoef(errors.T) - np.eye(errors.shape[1])
    assert np.abs(axes).max() < bound
    assert np.abs((errors[1:] * errors[:-1]).mean(axis=0)).max() < bound * sigma**2


def test_attitude_noise_is_a_small_rotation_of_its_standard_deviation() -> None:
    faulty, state, ticks, sigma = sensors("noise_attitude@0:1e-3"), a_state(0), 4000, 1e-3
    truth = rotation_of(state.quaternion)
    errors = np.empty((ticks, 3))
    for tick in range(ticks):
        state.tick = tick
        measured = faulty.measure(state).quaternion
        assert abs(np.linalg.norm(measured) - 1.0) < 1e-14
        assert measured @ state.quaternion > 0.99, "the quaternion's sign does not flip"
        errors[tick] = (rotation_of(measured) * truth.inv()).as_rotvec()
    bound = 5.0 / np.sqrt(ticks)
    assert np.abs(errors.mean(axis=0)).max() < bound * sigma
    assert np.abs(errors.std(axis=0) / sigma - 1.0).max() < bound
    assert np.abs(np.corrcoef(errors.T) - np.eye(3)).max() < bound


@given(SEEDS, st.floats(1e-6, 3.0))
def test_what_is_turned_is_turned_by_that(seed: int, size: float) -> None:
    """Against scipy; and a rotation vector turns the identity into its quaternion."""
    rng = np.random.default_rng(seed)
    quaternion, rotation = random_quaternion(rng), size * rng.normal(size=3)
    actual = rotation_of(turned(quaternion, rotation)).as_matrix()
    expected = type(rotation_of(quaternion)).from_rotvec(rotation) * rotation_of(quaternion)
    np.testing.assert_allclose(actual, expected.as_matrix(), atol=1e-14)
    back = turned(np.array([1.0, 0.0, 0.0, 0.0]), rotation_vector(quaternion))
    np.testing.assert_allclose(back, quaternion, atol=1e-14)


@given(SEEDS, st.floats(1e-9, 1.0))
def test_a_quantised_attitude_is_unit_and_within_half_a_step(seed: int, step: float) -> None:
    state = a_state(0, seed)
    measured = sensors(f"quantise_attitude@0:{step!r}").measure(state).quaternion
    assert abs(np.linalg.norm(measured) - 1.0) < 1e-14
    true = rotation_vector(state.quaternion)
    steps = rotation_vector_near(measured, true) / step
    assert np.abs(steps - true / step).max() < 0.5 + 1e-13 / step
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-13 / step)


def rotation_vector_near(quaternion: Array, near: Array) -> Array:
    """Of the vectors with this quaternion (4 pi apart in angle, both ways round), the nearest."""
    vector = rotation_vector(quaternion)
    angle = np.linalg.norm(vector)
    candidates = [vector] if angle == 0.0 else [vector, vector * (1.0 - 4.0 * np.pi / angle)]
    return min(candidates, key=lambda v: float(np.linalg.norm(v - near)))


@given(SEEDS, st.floats(1e-9, 10.0), st.sampled_from(list(FIELDS)))
def test_quantised_numbers_are_whole_steps_and_within_half_a_one(
    seed: int, step: float, name: str
) -> None:
    state = a_state(0, seed)
    values = getattr(sensors(f"quantise_{name}@0:{step!r}").measure(state), FIELDS[name])
    np.testing.assert_array_equal(values, step * np.round(values / step))
    assert np.abs(values - getattr(state, FIELDS[name])).max() <= 0.5 * step * (1.0 + 1e-6)


def test_a_tick_measured_twice_reads_the_same() -> None:
    """The plant sends a state again when no answer comes."""
    texts = ("noise_attitude@0:0.1", "noise_gyro@0:0.1")
    faulty = sensors(*texts)
    first = faulty.measure(a_state(300)).omega_base.copy()
    faulty.measure(a_state(4))
    np.testing.assert_array_equal(faulty.measure(a_state(300)).omega_base, first)
    np.testing.assert_array_equal(sensors(*texts).measure(a_state(300)).omega_base, first)
    assert (sensors(*texts, seed=1).measure(a_state(300)).omega_base != first).all()


def test_quantisation_comes_after_noise_whatever_the_order_given() -> None:
    values = sensors("quantise_gyro@0:0.5", "noise_gyro@0:0.3").measure(a_state(0)).omega_base
    np.testing.assert_array_equal(values, 0.5 * np.round(values / 0.5))


def spoilt(*texts: str, ticks: int = 400, seed: int = 0) -> list[RobotState]:
    corruption = Corruption(schedule(*texts, seed=seed))
    states = [a_state(tick) for tick in range(ticks)]
    for state in states:
        corruption.spoil_state(state, state.tick)
    return states


@pytest.mark.parametrize(("kind", "test"), [("nan_state", np.isnan), ("inf_state", np.isposinf)])
def test_one_measured_number_is_not_finite(kind: str, test: Any) -> None:
    """Any of them, never the echo of the torque, nothing else."""
    seen = set()
    for state in spoilt(f"{kind}@0"):
        (name,) = changed(state, a_state(state.tick))
        values = getattr(state, name)
        assert test(values).sum() == 1
        assert np.isfinite(values).sum() == values.size - 1
        seen.add((name, int(np.argmax(test(values)))))
    assert len(seen) == 3 + 4 + 3 + 3 + 2 * N
    assert "applied_torque" not in {name for name, _ in seen}


def test_corruption_with_a_probability() -> None:
    hit = [not np.isfinite(np.concatenate([s.base_position, s.quaternion, s.base_velocity,
           s.omega_base, s.joint_positions, s.joint_velocities])).all()
           for s in spoilt("nan_state@0:0.3", ticks=2000)]  # fmt: skip
    assert np.mean(hit) == pytest.approx(0.3, abs=0.05)
    assert not any(changed(s, a_state(s.tick)) for s in spoilt("nan_state@0:0", "inf_state@0:0"))


def test_a_scaled_quaternion_is_off_by_a_tenth_both_ways() -> None:
    norms = [np.linalg.norm(state.quaternion) for state in spoilt("scaled_quaternion@0")]
    assert {round(float(norm), 12) for norm in norms} == {0.9, 1.1}


def test_stamps_go_back_or_far_ahead_and_never_below_zero() -> None:
    back, ahead = Corruption(schedule("stamp_back@0")), Corruption(schedule("stamp_jump@0"))
    steps = {tick - back.stamp(tick) for tick in range(100, 500)}
    assert steps == set(range(1, STAMP_BACK_TICKS + 1))
    assert all(0 <= back.stamp(tick) < max(tick, 1) for tick in range(20))
    assert {ahead.stamp(tick) - tick for tick in range(100)} == {STAMP_JUMP_TICKS}
    plain = Corruption(schedule("stamp_back@0:0", "stamp_jump@5"))
    assert [plain.stamp(tick) for tick in range(100)] == list(range(100))


@pytest.mark.parametrize(("kind", "test"), [("nan_command", np.isnan), ("inf_command", np.isinf)])
def test_one_commanded_torque_is_not_finite(kind: str, test: Any) -> None:
    corruption, seen = Corruption(schedule(f"{kind}@0.1")), set()
    for tick in range(400):
        command = Command(tick, np.ones(N + 3))
        corruption.spoil_command(command, tick)
        assert test(command.torque).sum() == (tick >= 200)
        assert (command.torque == 1.0).sum() == N + 3 - (tick >= 200)
        seen |= set(np.flatnonzero(test(command.torque)).tolist())
    assert seen == set(range(N + 3))
