"""The star tracker: its noise by axis, its rate, its delay to the tick, its blindness."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import rotation_of
from pydantic import ValidationError
from scipy.spatial.transform import Rotation
from sensor_bench import PERIOD, Bench, N, a_state

from space_robot_model.hardware.star_tracker import StarTrackerSettings
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotState

Array = NDArray[np.float64]


def turning(tick: int) -> RobotState:
    """A base that turns about z, by 1e-3 rad a tick; at rest before tick 0."""
    state = RobotState.allocate(N)
    state.tick = tick
    state.quaternion[:] = [np.cos(5e-4 * tick), 0.0, 0.0, np.sin(5e-4 * tick)]
    return state


def ticks_shown(bench: Bench, ticks: int) -> list[int]:
    """The tick whose attitude is told at each tick, of a tracker without noise."""
    told = [bench.measure(turning(tick)).quaternion.copy() for tick in range(ticks)]
    return [round(2.0 * np.arctan2(q[3], q[0]) / 1e-3) for q in told]


@given(st.integers(1, 40), st.integers(0, 80))
def test_it_is_sampled_held_and_late_to_the_tick(interval: int, delay: int) -> None:
    settings = {"rate": 1.0 / (interval * PERIOD), "delay": delay * PERIOD}
    if delay // interval > 63:
        with pytest.raises(InputError, match=r"star_tracker\.delay holds .* at most 63"):
            Bench(star_tracker=settings)
        return
    bench = Bench(truth=turning(0), star_tracker=settings)
    expected = [max(0, (tick - delay) // interval * interval) for tick in range(200)]
    assert ticks_shown(bench, 200) == expected


@given(st.integers(1, 40), st.integers(0, 80))
def test_a_base_that_turned_before_tick_0_is_shown_as_it_was_then(
    interval: int, delay: int
) -> None:
    """With no jump of what is told: late from the first tick on."""
    truth = turning(0)
    truth.omega_base[2] = 1e-3 / PERIOD
    settings = {"rate": 1.0 / (interval * PERIOD), "delay": delay % (8 * interval) * PERIOD}
    bench, late = Bench(truth=truth, star_tracker=settings), delay % (8 * interval)
    shown = [(tick - late) // interval * interval if tick >= late else -late for tick in range(200)]
    assert ticks_shown(bench, 200) == shown


@pytest.mark.parametrize("period", [PERIOD, 4e-3])
def test_an_interval_is_a_whole_number_of_ticks(period: float) -> None:
    """The nearest, at any period."""
    settings = {"rate": 1.0 / (6.67 * period), "delay": 2.4 * period}
    tracker = Bench(period=period, star_tracker=settings).block[0].star_tracker
    assert (tracker.interval, tracker.delay) == (7, 2)


@pytest.mark.parametrize("boresight", [[0.0, 0.0, 1.0], [1.0, 2.0, -2.0]])
def test_noise_is_that_of_each_axis(boresight: list[float]) -> None:
    """Covariance on base axes: across^2 (E - b b^T) + about^2 b b^T."""
    across, about, count = 1e-4, 8e-4, 6000
    state = a_state()
    bench = Bench(
        star_tracker={"noise_across": across, "noise_about": about, "boresight": boresight}
    )
    seen = bench.watch(state, count, "quaternion")
    errors = (rotation_of(state.quaternion).inv() * rotations(seen)).as_rotvec()
    b = np.array(boresight) / np.linalg.norm(boresight)
    expected = across**2 * (np.eye(3) - np.outer(b, b)) + about**2 * np.outer(b, b)
    found = errors.T @ errors / count
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.abs((found - expected) / scale).max() < 5.0 * np.sqrt(2.0 / count)
    assert np.abs(errors.mean(axis=0) / np.sqrt(np.diag(expected))).max() < 5.0 / np.sqrt(count)


def rotations(quaternions: Array) -> Rotation:
    return Rotation.from_quat(quaternions[:, [1, 2, 3, 0]])


def test_its_numbers_are_uniform_within_half_a_step() -> None:
    """Error about each axis: uniform numbers of the quaternion make STEP / 12^1/2."""
    rng, step, count = np.random.default_rng(0), 1e-3, 4000
    bench, errors = Bench(star_tracker={"step": step}), np.empty((count, 3))
    state = a_state()
    for tick in range(count):
        state.tick = tick
        state.quaternion[:] = Rotation.random(rng=rng).as_quat()
        measured = rotation_of(bench.measure(state).quaternion)
        errors[tick] = (rotation_of(state.quaternion).inv() * measured).as_rotvec()
    assert np.abs(errors.std(axis=0) / (step / np.sqrt(12.0)) - 1.0).max() < 5.0 / np.sqrt(count)


def test_a_blind_tracker_tells_what_it_told_last() -> None:
    """What was exposed before is still released; exposures within the time are lost."""
    settings = {"rate": 1.0 / (10 * PERIOD), "delay": 5 * PERIOD}
    bench = Bench("tracker_blind@0.0205-0.0405", truth=turning(0), star_tracker=settings)
    shown = ticks_shown(bench, 100)  # blind in ticks 41 to 80
    assert shown[41:45] == [30] * 4
    assert shown[45:95] == [40] * 50
    assert shown[95:] == [90] * 5


def test_the_first_measurement_is_there_at_once_with_its_noise() -> None:
    """However late the others are; then each is held until the next is released."""
    settings = {"rate": 1.0 / (10 * PERIOD), "delay": 25 * PERIOD, "noise_across": 1e-3}
    bench = Bench(truth=turning(0), star_tracker=settings)
    told = np.array([bench.measure(turning(tick)).quaternion.copy() for tick in range(60)])
    assert (told[0] != turning(0).quaternion).any()
    assert np.flatnonzero(np.diff(told, axis=0).any(axis=1)).tolist() == [34, 44, 54]


def test_a_tracker_that_is_blind_from_the_start_tells_where_the_base_was() -> None:
    bench = Bench("tracker_blind@0-0.01", truth=turning(0), star_tracker={"noise_across": 0.1})
    for tick in range(20):
        told = bench.measure(turning(tick)).quaternion
        np.testing.assert_array_equal(told, turning(0).quaternion)
    assert (bench.measure(turning(20)).quaternion != turning(20).quaternion).all()


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        ({"rate": 2001.0}, "star_tracker.rate must be at most one .* a tick, 2000 Hz, got 2001"),
        ({"rate": 1000.0, "delay": 1.0}, "star_tracker.delay holds 1000 measurements, at most 63"),
    ],
)
def test_what_does_not_fit_is_refused(settings: dict[str, Any], why: str) -> None:
    with pytest.raises(InputError, match=f"^sensors given: {why}"):
        Bench(star_tracker=settings)


@pytest.mark.parametrize("boresight", [[0.0, 0.0, 0.0], [0.0, 1e9, 0.0], [1.0, 0.0]])
def test_a_boresight_is_a_direction(boresight: list[float]) -> None:
    with pytest.raises(ValidationError, match="boresight"):
        StarTrackerSettings(boresight=boresight)
