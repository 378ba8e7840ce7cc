"""Thrusters: non-negative least squares, and pulses whose mean is the demand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from allocation_bench import PERIOD, couples
from scipy.optimize import linprog, nnls

from space_robot_control.allocation.non_negative import NonNegative, solve
from space_robot_control.allocation.settings import AllocationSettings
from space_robot_control.allocation.thrusters import (
    AssumedThrusters,
    expect_torque,
    find_times,
    modulate,
    within_reach,
)
from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import ThrusterSettings
from space_robot_msgs_py.samples import MOST_THRUSTERS

KINDS = ["pwm", "sigma_delta", "schmitt"]

# Non-negative least squares


def solution(columns: Array, wanted: Array) -> Array:
    problem, count = NonNegative.allocate(1), columns.shape[1]
    problem.gram[:count, :count] = columns.T @ columns
    problem.right[:count] = columns.T @ wanted
    solve(problem, count)
    return np.array(problem.x[:count])


def mounted(rng: np.random.Generator) -> Array:
    """Columns of thrusters in pairs, as they are mounted: opposite, parallel, equal, none."""
    few = rng.integers(-1, 2, size=(6, 4)).astype(float)
    return np.hstack([few, -few, few, 2.0 * few[:, :2], np.zeros((6, 1))])


@pytest.mark.parametrize("count", [1, 3, 6, 7, 12, 24, 0])
def test_as_good_as_scipys(count: int) -> None:
    """0: dependent columns."""
    rng = np.random.default_rng(count)
    for _ in range(25):
        columns = rng.normal(size=(6, count)) if count else mounted(rng)
        wanted = rng.normal(size=6)
        x, (expected, residual) = solution(columns, wanted), nnls(columns, wanted)
        assert np.all(x >= 0.0)
        assert np.linalg.norm(columns @ x - wanted) == pytest.approx(residual, rel=1e-7, abs=1e-6)
        if 0 < count <= 6:
            np.testing.assert_allclose(x, expected, rtol=1e-6, atol=1e-7)
        if count == MOST_THRUSTERS:
            assert np.count_nonzero(x) <= 6


# Pulses


def slanted(force: float, shortest_pulse: float) -> dict[str, Any]:
    """Ten that point anywhere, each about all axes at once."""
    positions, directions = np.random.default_rng(4).normal(size=(2, 10, 3))
    vectors = {"positions": positions.ravel().tolist(), "directions": directions.ravel().tolist()}
    return couples(force, shortest_pulse) | vectors


class Bench:
    def __init__(self, kind: str, layout: Any = couples, pulse: float = 0.01, **more: Any) -> None:
        delay = [more.pop("delay", 0.0)]
        assumed = ThrusterSettings(**layout(10.0, pulse), delay=delay)
        settings = AllocationSettings(modulation=kind, **more)  # type: ignore[arg-type]
        self.count = assumed.count
        self.torques = assumed.torques
        self.forces = assumed.unit_directions * 10.0
        self.thrusters = AssumedThrusters.build(1, assumed, settings, PERIOD)

    def fly(self, demands: Array, first: int = 0) -> Array:
        """(ticks, T), 1 where open, from a tick on."""
        rows = []
        for tick, demand in enumerate(demands, first):
            modulate(self.thrusters, tick, demand)
            rows.append(self.thrusters.is_open[: self.count].copy())
        return np.array(rows)


def lengths(row: Array) -> Array:
    """Ticks of each pulse of a thruster that had ended."""
    edges = np.diff(np.concatenate([[0.0], row]))
    begins, ends = np.flatnonzero(edges > 0.0), np.flatnonzero(edges < 0.0)
    return np.asarray(ends - begins[: ends.size])


@pytest.mark.parametrize("layout", [couples, slanted])
@pytest.mark.parametrize("kind", KINDS)
def test_mean_torque_follows_the_demand(kind: str, layout: Any) -> None:
    bench = Bench(kind, layout)
    demand = np.array([1.3, -0.4, 0.02])
    opened = bench.fly(np.tile(demand, (4000, 1)))
    mean = opened.mean(axis=0) @ bench.torques
    one = np.linalg.norm(bench.torques, axis=1).max() * 0.1 / 2.0  # a whole pulse of 0.1 s in 2 s
    np.testing.assert_allclose(mean, demand, atol=one)
    owed = (4000 * demand - opened.sum(axis=0) @ bench.torques) * PERIOD
    np.testing.assert_allclose(bench.thrusters.owed[:3], owed, atol=1e-9)


@pytest.mark.parametrize("layout", [couples, slanted])
@pytest.mark.parametrize("kind", KINDS)
def test_no_pulse_is_shorter_than_allowed(kind: str, layout: Any) -> None:
    rng, bench = np.random.default_rng(1), Bench(kind, layout, pulse=0.02)
    demands = np.repeat(rng.normal(size=(40, 3)) * 3.0, 100, axis=0)
    opened = bench.fly(demands)
    pulses = np.concatenate([lengths(row) for row in opened.T])
    assert pulses.size > 5
    assert pulses.min() >= 40
    assert bench.thrusters.pulses.sum() >= pulses.size


@pytest.mark.parametrize("kind", KINDS)
def test_opposite_demands_cancel(kind: str) -> None:
    """Noise about zero opens no valve."""
    demands = np.random.default_rng(2).normal(size=(4000, 3)) * 0.3
    opened = Bench(kind).fly(demands)
    assert opened.sum() * 10.0 < np.abs(demands).sum() * 0.02


@pytest.mark.parametrize("kind", KINDS)
def test_demand_beyond_all_thrusters_is_not_owed(kind: str) -> None:
    bench = Bench(kind)
    demands = np.zeros((4000, 3))
    demands[:2000, 0], demands[:2000, 1] = 200.0, 20.0
    opened = bench.fly(demands)
    np.testing.assert_allclose(opened[500:1500].mean(axis=0) @ bench.torques, [20, 2, 0], atol=0.7)
    assert opened[2400:].sum() == 0.0


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("gap", [300, -50, 0])
def test_after_a_gap_all_begins_anew(kind: str, gap: int) -> None:
    """As from the first tick: nothing is owed, no pulse goes on, no decision is waited for.

    Ticks that are skipped, a clock that goes back, the same tick again.
    """
    rng = np.random.default_rng(3)
    demands = np.repeat(rng.normal(size=(100, 3)) * 8.0 + 4.0, 6, axis=0)
    later = rng.normal(size=(400, 3)) * 4.0
    bench, fresh = Bench(kind), Bench(kind)
    last = 99
    while last < 180 or not np.any(bench.thrusters.open_for > 0.0):  # amid a pulse
        last += 1
        bench.fly(demands[last - 100 : last - 99], first=last)
    pulses = bench.thrusters.pulses.copy()
    opened = bench.fly(later, first=last + gap)
    np.testing.assert_array_equal(opened, fresh.fly(later))
    np.testing.assert_array_equal(bench.thrusters.owed, fresh.thrusters.owed)
    np.testing.assert_array_equal(bench.thrusters.pulses - pulses, fresh.thrusters.pulses)


@pytest.mark.parametrize("after", [1, 20, 300])
def test_after_a_gap_what_is_under_way_is_expected_and_nothing_else(after: int) -> None:
    """Pulses commanded before the gap come a valve's delay later, also in it, and never again."""
    delay, first = 12, 300
    bench, torque = Bench("pwm", delay=delay * PERIOD), np.zeros(3)
    given: dict[int, Array] = {}
    ticks = [*range(60), *range(60 + after, 60 + after + first)]
    for tick in ticks:
        demand = np.array([12.0, -8.0, 5.0]) if tick < 60 else np.zeros(3)
        modulate(bench.thrusters, tick, demand)
        expect_torque(bench.thrusters, tick, torque)
        given[tick + delay] = bench.thrusters.is_open[: bench.count] @ bench.torques
        np.testing.assert_allclose(torque, given.get(tick, np.zeros(3)), atol=1e-12)


def test_an_impulse_beyond_a_period_is_cut_in_its_direction_and_forgotten() -> None:
    """Pulse width: 50 N m s are owed, a period of 0.1 s pays 2 N m s of them."""
    bench = Bench("pwm")
    bench.fly(np.zeros((1, 3)))
    bench.thrusters.slot_left = 0.0
    bench.thrusters.owed[:3] = [50.0, -25.0, 5.0]
    opened = bench.fly(np.zeros((600, 3)), first=1)
    np.testing.assert_allclose(opened[:200].sum(axis=0) @ bench.torques * PERIOD, [2, -1, 0.2])
    assert opened[200:].sum() == 0.0
    np.testing.assert_allclose(bench.thrusters.owed, 0.0, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("layout", [couples, slanted])
def test_within_reach_has_the_hardest_worked_thruster_open_all_the_time(
    kind: str, layout: Any
) -> None:
    """The times are a solution of least squares: one of several, where there are several."""
    rng, bench = np.random.default_rng(8), Bench(kind, layout)
    columns = bench.thrusters.wrench[: bench.count].T
    cut = 0
    for _ in range(40):
        demand = np.append(rng.normal(size=3) * 10.0 ** rng.uniform(-0.5, 2.0), np.zeros(3))
        share = within_reach(bench.thrusters, demand)
        find_times(bench.thrusters, demand)
        times = bench.thrusters.problem.x[: bench.count].copy()
        residual = nnls(columns, demand)[1]
        assert np.linalg.norm(columns @ times - demand) == pytest.approx(residual, abs=1e-6)
        largest = linprog(
            np.append(np.zeros(bench.count), -1.0),
            A_eq=np.column_stack([columns, -columns @ times]),
            b_eq=np.zeros(6),
            bounds=[(0.0, 1.0)] * bench.count + [(0.0, 1.0)],
        )
        assert share <= -largest.fun * (1.0 + 1e-6)
        if share < 1.0:
            assert share == pytest.approx(1.0 / times.max(), rel=1e-9)
        cut += share < 1.0
    assert 5 < cut < 40


def test_schmitt_trigger_has_hysteresis() -> None:
    """Wider thresholds: longer, rarer pulses."""
    demand = np.tile([1.0, 0.0, 0.0], (8000, 1))
    narrow = Bench("schmitt").fly(demand)
    wide = Bench("schmitt", schmitt_on=3.0, schmitt_off=-3.0).fly(demand)
    few, many = (sum(lengths(row).size for row in opened.T) for opened in (wide, narrow))
    assert 0 < few < 0.5 * many
    longest = max(lengths(row).max(initial=0) for row in wide.T)
    assert longest > 2 * max(lengths(row).max(initial=0) for row in narrow.T)
