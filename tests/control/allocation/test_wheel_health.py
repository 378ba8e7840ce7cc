"""Wheels that have failed are found by what they give, and no others are blamed."""

from __future__ import annotations

import numpy as np
import pytest
from allocation_bench import AllocationBench
from numpy.typing import NDArray

Array = NDArray[np.float64]
DEMAND = np.array([0.3, 0.2, 0.1])


def sound(bench: AllocationBench) -> list[int]:
    """Wheels that take part."""
    return np.flatnonzero(bench.allocation.wheels.healthy.takes_part[: bench.count]).tolist()


@pytest.mark.parametrize("latency", [0, 7])
def test_failed_wheel_is_found_and_taken_out(latency: int) -> None:
    bench = AllocationBench(latency=latency, failure_ticks=50)
    bench.fly(DEMAND, 200)
    assert sound(bench) == [0, 1, 2, 3]
    bench.failed = {2}
    wrong = bench.fly(DEMAND, 49)
    assert np.abs(wrong[latency:] - DEMAND).max() > 0.05
    right = bench.fly(DEMAND, 100)
    np.testing.assert_allclose(right[-50:], np.tile(DEMAND, (50, 1)), atol=1e-12)
    assert sound(bench) == [0, 1, 3]


def test_it_takes_failure_ticks_of_silence_in_a_row() -> None:
    """A tick in which the wheel gives something begins the count anew."""
    bench = AllocationBench(failure_ticks=10, null_gain=0.0)
    bench.fly(DEMAND, 3)
    for _ in range(5):
        bench.failed = {2}
        bench.fly(DEMAND, 9)
        bench.failed = set()
        bench.fly(DEMAND, 1)
    assert sound(bench) == [0, 1, 2, 3]
    bench.failed = {2}
    bench.fly(DEMAND, 10)
    assert sound(bench) == [0, 1, 2, 3]  # the tenth silence is heard at the next tick
    bench.fly(DEMAND, 1)
    assert sound(bench) == [0, 1, 3]


@pytest.mark.parametrize(("share", "is_silent"), [(0.25, False), (0.15, True), (-0.25, False)])
def test_a_wheel_that_gives_less_than_a_fifth_is_silent(share: float, is_silent: bool) -> None:
    bench = AllocationBench(failure_ticks=10, null_gain=0.0)
    for _ in range(20):
        bench.step(DEMAND)
        bench.state.wheel_torques[3] *= share
    assert sound(bench) == ([0, 1, 2] if is_silent else [0, 1, 2, 3])


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("share", "is_judged"), [(0.979, True), (0.981, False)])
def test_a_full_wheel_is_not_blamed(share: float, is_judged: bool, side: float) -> None:
    """From 98 % of its largest momentum on a wheel may give nothing; its own limit counts."""
    limits = [100.0, 50.0, 10.0, 100.0]
    bench = AllocationBench(
        momenta=[0.0, 0.0, side * share * 10.0, 0.0],
        wheels={"max_momentum": limits},
        failure_ticks=5,
        null_gain=0.0,
    )
    bench.failed = {2}
    bench.fly(DEMAND, 20)
    assert sound(bench) == ([0, 1, 3] if is_judged else [0, 1, 2, 3])


@pytest.mark.parametrize(("load", "is_judged"), [(2e-3, True), (0.5e-3, False)])
def test_little_that_is_asked_tells_nothing(load: float, is_judged: bool) -> None:
    """A thousandth of the motor's own largest torque."""
    most = [1.0, 4.0, 0.1]
    bench = AllocationBench(np.eye(3), wheels={"max_torque": most}, failure_ticks=5)
    bench.failed = {1}
    bench.fly([0.1, 4.0 * load, 0.01], 20)
    assert sound(bench) == ([0, 2] if is_judged else [0, 1, 2])


def test_a_gap_in_the_ticks_is_no_silence() -> None:
    """What was asked for before it need not have been given over the tick before this one."""
    bench = AllocationBench(failure_ticks=3, null_gain=0.0)
    for _ in range(10):
        bench.step(DEMAND)
        bench.state.wheel_torques[1] = 0.0
        bench.tick += 5
    assert sound(bench) == [0, 1, 2, 3]


def test_demand_that_alternates_blames_no_late_wheel() -> None:
    bench, rng = AllocationBench(latency=5, failure_ticks=50), np.random.default_rng(4)
    for _ in range(3000):
        bench.step(rng.normal(size=3) * 0.3)
    assert sound(bench) == [0, 1, 2, 3]


def test_commands_that_do_not_arrive_blame_no_wheel() -> None:
    """Of one wheel alone that is asked, that cannot be told apart: it is blamed."""
    bench = AllocationBench(failure_ticks=50)
    bench.failed = {0, 1, 2, 3}
    bench.fly(DEMAND, 1000)
    assert sound(bench) == [0, 1, 2, 3]
    alone = AllocationBench(np.eye(3), failure_ticks=50)
    alone.failed = {1}
    alone.fly([0.0, 0.3, 0.0], 60)
    assert sound(alone) == [0, 2]


def test_a_failed_wheel_is_out_of_everything() -> None:
    """Its momentum counts for nothing, and it is asked for nothing, whichever others are full."""
    axes = np.vstack([np.eye(3), np.ones((2, 3))])
    bench = AllocationBench(axes, failure_ticks=5, null_gain=0.0)
    bench.failed = {3}
    bench.fly(DEMAND, 20)
    bench.momenta[3] = 15.0
    given = bench.step(DEMAND)
    np.testing.assert_allclose(given, DEMAND, atol=1e-12)
    assert bench.command[3] == 0.0
    assert bench.allocation.wheels.momentum[3] == 0.0
    bench.momenta[:3] = -19.8  # all the others but one are full, too
    bench.step(np.array([0.1, 0.1, 0.1]))
    assert bench.command[3] == 0.0
    assert abs(bench.command[4]) == pytest.approx(0.1 * np.sqrt(3.0))
