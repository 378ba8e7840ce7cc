"""Messages that are corrupted: which numbers, how often, and their stamps."""

from __future__ import annotations

from collections import Counter
from typing import Any

import numpy as np
import pytest
from random_robots import random_quaternion
from random_samples import random_sample
from scipy.stats import chisquare

from space_robot_msgs_py.samples import PASSIVE_FIELDS, STATE_FIELDS, Command, RobotState
from space_robot_sim.faults.corruption import (
    MEASURED,
    STAMP_BACK_TICKS,
    STAMP_JUMP_TICKS,
    Corruption,
)
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.faults.schedule import Schedule
from space_robot_sim.plant.faults import PLANT_KINDS

PERIOD = 5e-4
N = 6


def schedule(*texts: str, seed: int = 0) -> Schedule:
    return Schedule(parse_faults(texts, PLANT_KINDS), seed, PERIOD)


def a_state(tick: int, seed: int = 1) -> RobotState:
    state = random_sample(N, seed, tick)
    state.quaternion[:] = random_quaternion(np.random.default_rng(seed))
    return state


def changed(measured: RobotState, state: RobotState) -> set[str]:
    names = list(STATE_FIELDS)
    return {n for n in names if (getattr(measured, n) != getattr(state, n)).any()}


def spoilt(*texts: str, ticks: int = 400, seed: int = 0) -> list[RobotState]:
    corruption = Corruption(schedule(*texts, seed=seed))
    states = [a_state(tick) for tick in range(ticks)]
    for state in states:
        corruption.corrupt_state(state, state.tick)
    return states


@pytest.mark.parametrize(
    ("kind", "test", "passive", "share"),
    [("nan_state", np.isnan, 3, 0.5), ("inf_state", np.isposinf, 0, 1.0)],
)
def test_one_measured_number_is_not_finite(
    kind: str, test: Any, passive: int, share: float
) -> None:
    """Any of them, each as likely, never the echo of the torque, nothing else; P of the ticks."""
    corruption, seen = Corruption(schedule(f"{kind}@0:{share}"), passive), Counter[Any]()
    ticks, numbers = 1500, 3 + 4 + 3 + 3 + 2 * N + 2 * passive
    for tick in range(ticks):
        state = a_state(0)
        corruption.corrupt_state(state, tick)
        places = np.flatnonzero(~np.isfinite(state.numbers))
        assert test(state.numbers[places]).all()
        assert (state.numbers == a_state(0).numbers).sum() == state.numbers.size - places.size
        seen.update(places.tolist())
        assert places.size <= 1
    allowed = RobotState.allocate(N)
    for name in MEASURED:
        getattr(allowed, name)[:] = 1.0
    for name in PASSIVE_FIELDS:
        getattr(allowed, name)[:passive] = 1.0
    assert set(seen) == set(np.flatnonzero(allowed.numbers).tolist())
    assert seen.total() == pytest.approx(share * ticks, abs=5.0 * np.sqrt(0.25 * ticks))
    assert chisquare(list(seen.values())).pvalue > 1e-3
    assert len(seen) == numbers


def test_corruption_without_probability_is_none() -> None:
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
        corruption.corrupt_command(command, tick)
        assert test(command.torque).sum() == (tick >= 200)
        assert (command.torque == 1.0).sum() == N + 3 - (tick >= 200)
        seen |= set(np.flatnonzero(test(command.torque)).tolist())
    assert seen == set(range(N + 3))
