"""Wheels: tables of those that take part, least largest loads, limits, and failures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from allocation_bench import PERIOD, PYRAMID, AllocationBench, least, loads_of, unit, wheel_set
from numpy.typing import NDArray

from space_robot_control.allocation.allocation import diagnose
from space_robot_control.allocation.wheels import FULL
from space_robot_model.elementary.matrices import Array

CUBE = np.eye(3)
LAYOUTS = {
    "orthogonal": CUBE,
    "orthogonal and one": np.vstack([CUBE, [[1, 1, 1]]]),
    "pyramid": PYRAMID,
    "twice": np.vstack([CUBE, CUBE]),
    "twice, against": np.vstack([CUBE, -CUBE]),
    "three in a plane": np.vstack([CUBE, [[1, 1, 0], [1, -2, 0]]]),
    "five in a plane": np.array(
        [[1, 0, 0], [0, 1, 0], [1, 1, 0], [2, -1, 0], [1, 3, 0], [0, 0, 1]]
    ),
    "three parallel": np.array([[1, 0, 0], [1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, 0, 1]]),
    "five anyhow": np.random.default_rng(5).normal(size=(5, 3)),
    "eight anyhow": np.random.default_rng(8).normal(size=(8, 3)),
    "eight": np.vstack([PYRAMID, CUBE, [[1, 1, 1]]]),
}
SHARINGS = ("pseudo_inverse", "least_largest")
DEMAND = np.array([0.3, 0.2, 0.1])


# Tables


@pytest.mark.parametrize("count", [1, 2, 3, 4, 6, 8])
def test_tables_are_those_of_weighted_least_squares(count: int) -> None:
    """Of the wheels that take part; what is beyond them is what they do not span."""
    rng = np.random.default_rng(count)
    for _ in range(20):
        axes, loads = rng.normal(size=(count, 3)), rng.uniform(0.05, 5.0, count)
        out = rng.permutation(count)[: rng.integers(0, count + 1)]
        part = np.setdiff1d(np.arange(count), out)
        wheels = wheel_set(axes, loads, tuple(out))
        expected = np.zeros((count, 3))
        expected[part] = loads[part, None] * np.linalg.pinv(unit(axes[part]).T * loads[part])
        np.testing.assert_allclose(wheels.inverse[:count], expected, rtol=1e-6, atol=1e-9)
        assert wheels.rank == min(len(part), 3)
        spanned = np.linalg.pinv(unit(axes[part])) @ unit(axes[part])
        np.testing.assert_allclose(wheels.beyond, np.eye(3) - spanned, atol=1e-7)
        null = wheels.null[:count]
        assert np.abs(null).max() == pytest.approx(float(len(part) > 3))
        np.testing.assert_allclose(unit(axes).T @ null, 0.0, atol=1e-9)
        np.testing.assert_array_equal(null[out], 0.0)


# Least largest loads


def check(axes: Array, full: Array, wanted: Array) -> None:
    loads = loads_of(axes, full, wanted)
    np.testing.assert_allclose(
        unit(axes).T @ (loads * full), wanted, rtol=0.0, atol=1e-13 * np.abs(full).max() * 100
    )
    largest = np.abs(loads).max()
    assert largest == pytest.approx(least(axes, full, wanted), rel=1e-6, abs=1e-9)
    squares = np.linalg.pinv(unit(axes).T * full) @ wanted
    assert largest <= np.abs(squares).max() * (1.0 + 1e-9)


@pytest.mark.parametrize("name", LAYOUTS)
def test_layouts_of_wheels(name: str) -> None:
    axes, rng = LAYOUTS[name], np.random.default_rng(3)
    wanted = [*rng.normal(size=(5, 3)), *np.eye(3), *(-np.eye(3)), *axes, np.ones(3)]
    for full in (np.ones(len(axes)), rng.uniform(0.2, 3.0, len(axes))):
        for one in wanted:
            check(axes, full, np.asarray(one, dtype=float))


def test_a_wheel_that_is_out_and_no_demand_have_no_load() -> None:
    np.testing.assert_array_equal(loads_of(PYRAMID, np.ones(4), np.zeros(3)), 0.0)
    loads = loads_of(np.vstack([PYRAMID, [[0, 0, 1]]]), np.ones(5), np.ones(3), out=(2,))
    assert loads[2] == 0.0
    assert np.abs(loads[[0, 1, 3, 4]]).min() > 0.0


# Limits of torque and momentum


@pytest.mark.parametrize("sharing", SHARINGS)
def test_demand_beyond_the_motors_keeps_its_direction(sharing: str) -> None:
    """A wheel without a limit is scaled with the others, none counts as full."""
    most = [0.0, 0.2, 0.3, 0.2]
    bench = AllocationBench(wheels={"max_torque": most}, sharing=sharing, null_gain=0.0)
    demand = [30.0, -10.0, 5.0]
    np.testing.assert_allclose(np.cross(bench.step(demand), demand), 0.0, atol=1e-11)
    assert np.max(np.abs(bench.command[1:]) / most[1:]) == 1.0
    values = diagnose(bench.allocation).values
    assert (values["demand_scaled_ticks"], values["wheel_full_ticks"]) == (1, 0)


def headroom(momentum: Array, most: Array, torque: Array) -> Array:
    """The torque that fills each wheel to `FULL` within a tick, in the torque's direction."""
    room: Array = np.maximum(FULL * most - np.sign(torque) * momentum, 0.0) / PERIOD
    return room


def shared(
    axes: Array, most: Array, momentum: Array, holds: Array, demand: Array
) -> tuple[Array, bool]:
    """What each motor is asked for, as the manual says, and whether it is scaled down."""
    factors: list[float] = []

    def scaled(torque: Array) -> Array:
        factors.append(max(1.0, float(np.max(np.abs(torque) / most))))
        return np.asarray(torque / factors[-1])

    def squares(free: NDArray[np.bool_], wanted: Array) -> Array:
        columns = axes[free].T * most[free]
        return np.asarray(most[free] * (np.linalg.pinv(columns, rcond=1e-4) @ wanted))

    free = np.ones(len(axes), dtype=bool)
    torque = scaled(squares(free, -demand))
    while np.any(full := free & (np.abs(torque) > headroom(momentum, holds, torque))):
        torque[full] = np.sign(torque[full]) * headroom(momentum, holds, torque)[full]
        free &= ~full
        if free.any():
            torque[free] = squares(free, -demand - axes[~free].T @ torque[~free])
        torque = scaled(torque)
    return torque, max(factors) > 1.0


@pytest.mark.parametrize("count", [3, 4, 6])
def test_others_take_the_rest_of_full_wheels(count: int) -> None:
    """Any wheels, one or more of them full, with some room left or none, of any direction."""
    rng, full_ticks = np.random.default_rng(count), 0
    for _ in range(20):
        most, holds = rng.uniform(0.5, 2.0, count), rng.uniform(1.0, 5.0, count)
        bench = AllocationBench(
            rng.normal(size=(count, 3)),
            null_gain=0.0,
            wheels={
                "max_torque": most.tolist(),
                "max_momentum": holds.tolist(),
                "rotor_inertia": rng.uniform(0.01, 0.1, count).tolist(),
            },
        )
        share = rng.choice([0.0, 0.5, FULL - 3e-4 * rng.random(), FULL, 1.0], count)
        momentum = rng.choice([-1.0, 1.0], count) * share * holds
        bench.momenta[:] = momentum
        demand = rng.normal(size=3) * 10.0 ** rng.uniform(-1.0, 1.0)
        expected, is_scaled = shared(bench.axes, most, momentum, holds, demand)
        bench.step(demand)
        np.testing.assert_allclose(bench.command, expected, rtol=0.0, atol=1e-9)
        assert np.all(np.abs(bench.command) <= most)
        assert np.all(np.abs(bench.momenta) <= np.maximum(np.abs(momentum), FULL * holds) + 1e-12)
        assert bool(bench.allocation.wheels.is_scaled) is is_scaled
        full_ticks += int(bench.allocation.wheels.full_ticks)
    assert 5 < full_ticks < 20


@pytest.mark.parametrize("sharing", SHARINGS)
@pytest.mark.parametrize("k", [0, 2])
def test_full_wheel_leaves_its_axis_alone(k: int, sharing: str) -> None:
    """Of three wheels one is full: the other axes lose nothing, and it can be slowed down."""
    bench = AllocationBench(np.eye(3), momenta=-19.8 * np.eye(3)[k], sharing=sharing)
    demand = np.array([0.5, 0.3, 0.2])
    np.testing.assert_allclose(bench.step(demand), np.where(np.arange(3) == k, 0.0, demand))
    np.testing.assert_allclose(bench.step(-demand), -demand, atol=1e-12)
    assert bench.allocation.wheels.full_ticks == 1.0


# Failures


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
    for failed, ticks in (*[({2}, 9), (set(), 1)] * 5, ({2}, 10)):
        bench.failed = failed
        bench.fly(DEMAND, ticks)
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


ALMOST_FULL = [
    (
        {
            "momenta": [0.0, 0.0, side * share * 10.0, 0.0],
            "wheels": {"max_momentum": [99, 50, 10, 99]},
        },
        2,
        DEMAND,
        share < 0.98,
    )
    for side in (1.0, -1.0)
    for share in (0.979, 0.981)
]
"""From 98 % of its own largest momentum on a wheel may give nothing."""
LITTLE = [
    (
        {"axes": np.eye(3), "wheels": {"max_torque": [1.0, 4.0, 0.1]}},
        1,
        [0.1, 4.0 * load, 0.01],
        load > 1e-3,
    )
    for load in (2e-3, 0.5e-3)
]
"""Below a thousandth of its own largest torque it is not judged."""


@pytest.mark.parametrize(("options", "failed", "demand", "is_judged"), ALMOST_FULL + LITTLE)
def test_a_wheel_is_judged_by_what_it_can_give(
    options: dict[str, Any], failed: int, demand: Any, is_judged: bool
) -> None:
    bench = AllocationBench(**options, failure_ticks=5, null_gain=0.0)
    bench.failed = {failed}
    bench.fly(demand, 20)
    assert (failed not in sound(bench)) is is_judged
    assert len(sound(bench)) == bench.count - is_judged


def test_a_gap_in_the_ticks_is_no_silence() -> None:
    """What was asked for before it need not have been given over the tick before this one."""
    bench = AllocationBench(failure_ticks=3, null_gain=0.0)
    for _ in range(10):
        bench.step(DEMAND)
        bench.state.wheel_torques[1] = 0.0
        bench.tick += 5
    assert sound(bench) == [0, 1, 2, 3]


def test_commands_that_do_not_arrive_blame_no_wheel() -> None:
    """Of one wheel alone that is asked, that cannot be told apart: it is blamed."""
    bench = AllocationBench(failure_ticks=50)
    bench.failed = {0, 1, 2, 3}
    bench.fly(DEMAND, 300)
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
