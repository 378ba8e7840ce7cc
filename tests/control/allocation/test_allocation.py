"""Wheels, thrusters, and both: what is commanded for a torque on the base."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from allocation_bench import INERTIA, PERIOD, AllocationBench, couples


def test_null_motion_balances_and_the_base_feels_nothing() -> None:
    bench = AllocationBench(
        momenta=[8.0, -5.0, 8.0, -5.0],
        wheels={"max_torque": [20.0]},
        null_gain=10.0,
        null_share=1.0,
    )
    given = bench.fly(np.zeros(3), 2000)
    np.testing.assert_allclose(given, 0.0, atol=1e-13)
    stored = np.linalg.pinv(bench.axes.T) @ bench.axes.T @ [8.0, -5.0, 8.0, -5.0]
    np.testing.assert_allclose(bench.momenta, stored, atol=0.02)


@pytest.mark.parametrize("start", [0.0, [8.0, -3.0, -8.0, 1.0]])
def test_wheels_are_kept_from_zero_speed(start: Any) -> None:
    bench = AllocationBench(
        momenta=start, wheels={"max_torque": [20.0]}, null_gain=10.0, least_speed=50.0
    )
    bench.fly(np.zeros(3), 1500)
    assert np.abs(bench.momenta / INERTIA).min() > 50.0


def test_wheel_that_must_cross_zero_does_so_at_once() -> None:
    """A ramp through the stored momentum: 4 N m s are stored and taken out again and again."""
    wheels = {"max_torque": [8.0]}
    bench, ticks = AllocationBench(wheels=wheels, null_gain=40.0, least_speed=30.0), 5000
    bench.fly(np.zeros(3), 750)
    angles = 8.0 * np.arange(ticks) * PERIOD
    demands = 3.2 * np.stack([np.sin(angles), np.cos(angles), np.full(ticks, 0.2)], axis=1)
    given, momenta = np.empty((ticks, 3)), np.empty((ticks + 1, 4))
    momenta[0] = bench.momenta
    for tick, demand in enumerate(demands):
        given[tick] = bench.step(demand)
        momenta[tick + 1] = bench.momenta
    np.testing.assert_allclose(given, demands, atol=1e-11)
    assert np.sum(momenta[1:] * momenta[:-1] < 0.0) <= 40, "chatters"
    assert np.sum(np.abs(momenta[1:]) < 0.9 * 30.0 * INERTIA) < 0.02 * 4 * ticks


def test_thrusters_take_what_wheels_cannot_give() -> None:
    """Two failed wheels of four leave two axes; no wheels leave none."""
    demand = [0.3, 0.2, 0.1]
    benches = (
        AllocationBench(failure_ticks=50),
        AllocationBench(thrusters=couples(), failure_ticks=50),
    )
    for bench in benches:
        bench.fly(demand, 100)
        assert np.all(bench.command[4:] == 0.0)
        bench.failed = {1, 3}
        bench.fly(demand, 200)
        assert bench.allocation.wheels.healthy.rank == 2.0
    np.testing.assert_allclose(benches[0].step(demand), [0.3, 0.0, 0.1], atol=1e-12)
    for bench in (benches[1], AllocationBench(None, thrusters=couples())):
        given = bench.fly(demand, 3000)
        np.testing.assert_allclose(given.mean(axis=0), demand, atol=1e-2)


@pytest.mark.parametrize("wrong", [np.nan, np.inf])
def test_demand_that_is_no_number_is_not_owed(wrong: float) -> None:
    bench = AllocationBench(thrusters=couples(), null_gain=0.0)
    bench.allocation.wheels.healthy.beyond[:] = np.eye(3)  # as without wheels
    bench.allocation.wheels.healthy.rank = 0.0
    bench.step([0.3, wrong, 0.1])
    assert np.isfinite(bench.allocation.thrusters.owed).all()
    assert np.isfinite(bench.command[4:]).all()


def test_thrusters_unload_the_wheels_which_hold_the_base() -> None:
    bench = AllocationBench(
        thrusters=couples(0.4),
        momenta=[14.2, 0.0, -14.2, 0.0],
        wheels={"max_torque": [5.0]},
        unload_above=0.7,
        unload_to=0.6,
        unload_time=2.0,
        null_gain=0.0,
    )
    given = bench.fly(np.zeros(3), 12000)
    np.testing.assert_allclose(given, 0.0, atol=1e-12)
    assert np.abs(bench.momenta).max() < 12.1
    assert bench.allocation.unloading.is_active == 0.0
    pulses = bench.allocation.thrusters.pulses.sum()
    bench.fly(np.zeros(3), 1000)
    assert bench.allocation.thrusters.pulses.sum() == pulses


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("k", [0, 3])
def test_unloading_lasts_from_one_threshold_to_the_other(k: int, side: float) -> None:
    """Shares of each wheel's own largest momentum; the fullest wheel counts."""
    limits = np.array([40.0, 30.0, 50.0, 20.0])
    bench = AllocationBench(
        thrusters=couples(),
        wheels={"max_momentum": limits.tolist()},
        null_gain=0.0,
        unload_above=0.7,
        unload_to=0.3,
    )
    for share, is_active in ((0.69, 0.0), (0.71, 1.0), (0.31, 1.0), (0.29, 0.0), (0.69, 0.0)):
        bench.momenta[:] = 0.2 * limits
        bench.momenta[k] = side * share * limits[k]
        bench.step(np.zeros(3))
        assert bench.allocation.unloading.is_active == is_active
        assert np.any(bench.allocation.thruster_demand) == bool(is_active)


@pytest.mark.parametrize("count", [3, 4, 6])
def test_unloading_asks_what_half_of_the_wheels_torque_can_hold(count: int) -> None:
    """Against the momentum, within the time constant where that leaves the wheels enough."""
    rng, cut = np.random.default_rng(count), 0
    for _ in range(20):
        most = rng.uniform(0.3, 2.0, count)
        bench = AllocationBench(
            rng.normal(size=(count, 3)),
            couples(),
            momenta=rng.uniform(-19.0, 19.0, count),
            wheels={"max_torque": most.tolist()},
            unload_above=0.02,
            unload_to=0.01,
            unload_time=40.0,
            null_gain=0.0,
        )
        wanted = -bench.axes.T @ bench.momenta / 40.0
        shares = most[:, None] * np.linalg.pinv(bench.axes.T * most)
        excess = max(1.0, np.max(np.abs(shares @ wanted) / (0.5 * most)))
        bench.step(np.zeros(3))
        np.testing.assert_allclose(bench.allocation.thruster_demand, wanted / excess, atol=1e-9)
        cut += excess > 1.0
    assert 0 < cut < 20


def test_wheels_hold_against_pulses_when_these_come() -> None:
    """Valves are late by some ticks, each by its own; so is what the wheels do about them."""
    delays = np.arange(12) % 5
    bench = AllocationBench(
        thrusters={**couples(0.2), "delay": (delays * PERIOD).tolist()},
        momenta=[15.0, 0.0, -15.0, 0.0],
        null_gain=0.0,
        unload_above=0.1,
        unload_to=0.05,
    )
    opened = []
    for tick in range(200):
        bench.step([0.05, -0.02, 0.03])
        opened.append(bench.command[4:] > 0.0)
        comes = [opened[tick - d][j] if tick >= d else False for j, d in enumerate(delays)]
        given = -bench.command[:4] @ bench.axes + np.array(comes) @ bench.torques
        np.testing.assert_allclose(given, [0.05, -0.02, 0.03], atol=1e-12)
    assert np.any(opened)
