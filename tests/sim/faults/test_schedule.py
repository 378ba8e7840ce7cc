"""Faults in ticks: when they act, and their random numbers, drawn anew for each tick and fault."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.stats import chisquare, kstest

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotNames
from space_robot_sim.faults.grammar import parse_fault
from space_robot_sim.faults.schedule import BLOCK_TICKS, Schedule, ScheduledFault, TemporaryChange
from space_robot_sim.plant.faults import PLANT_KINDS

PERIOD = 5e-4
TICKS = 20 * BLOCK_TICKS


def placed(text: str, index: int = 0, seed: int = 0, **names: Any) -> ScheduledFault:
    robot = RobotNames(("shoulder", "elbow"), **names)
    return ScheduledFault(parse_fault(text, PLANT_KINDS), index, seed, PERIOD, robot)


@pytest.mark.parametrize(
    ("text", "first", "stop"),
    [
        ("drop_state@0", 0, math.inf),
        ("drop_state@0.01-0.02", 20, 40),
        ("drop_state@0.0101-0.0196", 21, 40),
        ("drop_state@0.01-0.0101", 20, 21),
    ],
)
def test_it_acts_from_its_first_tick_to_before_its_end(text: str, first: int, stop: float) -> None:
    fault = placed(text)
    assert [tick for tick in range(100) if fault.acts_at(tick)] == list(
        range(first, int(min(stop, 100)))
    )
    assert (fault.first, fault.stop) == (first, stop)


def test_a_time_without_a_tick_is_refused() -> None:
    with pytest.raises(InputError) as caught:
        placed("drop_state@0.0101-0.0102")
    assert str(caught.value) == (
        "fault 'drop_state@0.0101-0.0102': there is no tick of 0.0005 s in that time"
    )


def test_what_it_is_about_is_named_or_refused_with_the_faults_text() -> None:
    assert placed("stuck_joint@1:elbow=2").axes == (4,)
    assert placed("drop_state@1").axes == ()
    with pytest.raises(InputError, match=r"^fault 'stuck_joint@1:knee=2': .*elbow"):
        placed("stuck_joint@1:knee=2")


@pytest.mark.parametrize("share", [0.0, 0.1, 1.0])
def test_a_probability_is_the_share_of_ticks_and_choices_are_even(share: float) -> None:
    fault = placed(f"drop_state@0.05:{share}")
    first, happened = 100, [fault.happens_at(tick) for tick in range(TICKS)]
    assert not any(happened[:first])
    spread = 5.0 * math.sqrt(share * (1.0 - share) / TICKS)
    assert np.mean(happened[first:]) == pytest.approx(share, abs=spread + 1e-12)
    chosen = [fault.choose(tick, 7) for tick in range(TICKS)]
    assert chisquare(np.bincount(chosen, minlength=7)).pvalue > 1e-4
    assert max(chosen) == 6
    if share == 0.1:
        where = np.array(chosen[first:])[np.array(happened[first:])]
        assert chisquare(np.bincount(where, minlength=7)).pvalue > 1e-4, "independent of it"


def test_noise_is_normal_with_the_value_for_its_deviation() -> None:
    fault = placed("noise_gyro@0:0.25")
    numbers = np.array([fault.noise(tick, 3) for tick in range(TICKS)])
    assert kstest(numbers.ravel() / 0.25, "norm").pvalue > 1e-4
    assert abs(np.corrcoef(numbers.T) - np.eye(3)).max() < 0.1
    assert abs(np.corrcoef(numbers[1:, 0], numbers[:-1, 0])[0, 1]) < 0.1


@given(st.lists(st.integers(0, 3 * BLOCK_TICKS), min_size=1, max_size=20))
def test_numbers_are_those_of_the_tick_whatever_was_asked_before(ticks: list[int]) -> None:
    asked = placed("noise_gyro@0:1")
    for tick in ticks:
        np.testing.assert_array_equal(asked.noise(tick, 3), placed("noise_gyro@0:1").noise(tick, 3))


def test_each_seed_and_each_place_in_the_list_has_its_own_numbers() -> None:
    rows = [
        placed("noise_gyro@0:1", index, seed).noise(tick, 3)
        for index in range(2)
        for seed in range(2)
        for tick in (0, 1, BLOCK_TICKS)
    ]
    assert len(np.unique(np.concatenate(rows))) == 36
    texts = ("drop_state@0", "noise_gyro@0:1", "drop_state@1")
    schedule = Schedule([parse_fault(text, PLANT_KINDS) for text in texts], 1, PERIOD)
    (noise,) = schedule.of(PLANT_KINDS["noise_gyro"])
    np.testing.assert_array_equal(noise.noise(5, 3), placed(texts[1], 1, 1).noise(5, 3))
    assert schedule.of(PLANT_KINDS["drop_state"]) == [schedule.faults[0], schedule.faults[2]]
    assert schedule.of(PLANT_KINDS["nan_state"]) == []


def test_changes_are_taken_back_once_no_fault_acts() -> None:
    """Two that overlap; between the changes the part may be set anew by others."""
    faults = [placed("torque_scale@0.005-0.02:base=0.5"), placed("torque_scale@0.01-0.03:base=3")]
    change, values = TemporaryChange(faults), np.array([1.0, 2.0])

    def scale(part: NDArray[np.float64], fault: ScheduledFault) -> None:
        part *= fault.value

    seen = {tick: (change.apply(tick, values, scale), *values.tolist()) for tick in range(9)}
    assert set(seen.values()) == {(False, 1.0, 2.0)}
    values[:] = 10.0, 20.0
    seen = {tick: (change.apply(tick, values, scale), *values.tolist()) for tick in range(9, 70)}
    expected = {9: 1.0, 10: 0.5, 20: 1.5, 40: 3.0, 60: 1.0}
    for tick, row in seen.items():
        factor = expected[max(k for k in expected if k <= tick)]
        assert row == (tick in expected and tick > 9, 10.0 * factor, 20.0 * factor)
