"""Wheels at their limits: directions that are kept, full wheels, and what is counted of both."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from allocation_bench import PERIOD, AllocationBench
from numpy.typing import NDArray
from scipy.optimize import linprog

from space_robot_control.allocation.assumed_actuators import assumed_actuators
from space_robot_control.allocation.diagnosis import diagnose
from space_robot_control.allocation.wheels import FULL
from space_robot_model.robot import Robot

Array = NDArray[np.float64]

SHIPPED = ("wheels", "small_wheels", "wheels_and_thrusters")
SHARINGS = ("pseudo_inverse", "least_largest")


def shipped_axes(robot: Robot) -> list[Array]:
    return [assumed_actuators(name, robot).wheels.unit_axes for name in SHIPPED]


def largest_share(axes: Array, most: Array, demand: Array, sharing: str) -> float:
    """The largest s <= 1 for which the wheels give s times the demand, by SciPy."""
    if sharing == "pseudo_inverse":
        torque = np.diag(most) @ np.linalg.lstsq(axes.T * most, demand)[0]
        return min(1.0, 1.0 / float(np.max(np.abs(torque) / most)))
    found = linprog(
        [*np.zeros(len(axes)), -1.0],
        A_eq=np.column_stack([axes.T, demand]),
        b_eq=np.zeros(3),
        bounds=[*((-m, m) for m in most), (0.0, 1.0)],
        method="highs",
    )
    return float(found.x[-1])


@pytest.mark.parametrize("sharing", SHARINGS)
def test_demand_beyond_the_motors_keeps_its_direction(paper_robot: Robot, sharing: str) -> None:
    """No motor is asked for more than it has, one for all of it, and no wheel counts as full."""
    rng = np.random.default_rng(1)
    same = [
        (axes, np.full(len(axes), most))
        for axes in shipped_axes(paper_robot)[:1]
        for most in (0.1, 0.2, 0.4, 4.0)
    ]
    other = [(rng.normal(size=(n, 3)), rng.uniform(0.05, 5.0, n)) for n in (3, 4, 5, 8)]
    for axes, most in same + other:
        bench = AllocationBench(
            axes,
            wheels={"max_torque": most.tolist(), "max_momentum": [1e6]},
            sharing=sharing,
            null_gain=0.0,
        )
        scaled = 0
        for k in range(60):
            demand = rng.normal(size=3) * most.max() * 10.0 ** rng.uniform(-1.0, 5.0)
            bench.momenta[:] = 0.0
            given = bench.step(demand)
            share = given @ demand / (demand @ demand)
            assert np.abs(given - share * demand).max() < 1e-13 * most.max()
            loads = np.abs(bench.command) / most
            assert np.all(np.abs(bench.command) <= most)
            assert share > 1.0 - 1e-12 or np.max(loads) == 1.0
            scaled += share < 1.0 - 1e-12
            if k % 12 == 0:
                expected = largest_share(bench.axes, most, demand, sharing)
                assert share == pytest.approx(expected, rel=1e-9)
        assert diagnose(bench.allocation).values["demand_scaled_ticks"] == scaled > 30
        assert diagnose(bench.allocation).values["wheel_full_ticks"] == 0


def test_a_demand_beyond_the_motors_leaves_the_null_motion_nothing() -> None:
    """So a motor that is asked for all it has is told as saturated."""
    momenta = [8.0, -5.0, 8.0, -5.0]
    bench = AllocationBench(momenta=momenta, null_gain=1.0, null_share=1.0)
    alone = AllocationBench(momenta=momenta, null_gain=0.0)
    for demand in ([30.0, -10.0, 5.0], [0.3, -0.1, 0.2], [-30.0, 10.0, -5.0]):
        bench.step(demand)
        alone.step(demand)
        assert np.array_equal(bench.command, alone.command) is (demand[0] != 0.3)


def test_a_wheel_without_a_limit_is_scaled_with_the_others() -> None:
    bench = AllocationBench(wheels={"max_torque": [0.0, 0.2, 0.3, 0.2]}, null_gain=0.0)
    given = bench.step([30.0, -10.0, 5.0])
    np.testing.assert_allclose(np.cross(given, [30.0, -10.0, 5.0]), 0.0, atol=1e-12)
    assert np.max(np.abs(bench.command[1:]) / [0.2, 0.3, 0.2]) == 1.0


def headroom(momentum: Array, most: Array, torque: Array) -> Array:
    """The torque that fills each wheel to `FULL` within a tick, in the torque's direction."""
    room: Array = np.maximum(FULL * most - np.sign(torque) * momentum, 0.0) / PERIOD
    return room


def shared(axes: Array, most: Array, momentum: Array, holds: Array, demand: Array) -> Array:
    """What each motor is asked for, as the manual says: written down with SciPy's least squares."""

    def scaled(torque: Array) -> Array:
        return np.asarray(torque / max(1.0, np.max(np.abs(torque) / most)))

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
    return torque


@pytest.mark.parametrize("count", [3, 4, 6])
def test_others_take_the_rest_of_full_wheels(count: int) -> None:
    """Any wheels, one or more of them full, with some room left or none, of any direction."""
    rng, full_ticks = np.random.default_rng(count), 0
    for _ in range(40):
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
        expected = shared(bench.axes, most, momentum, holds, demand)
        bench.step(demand)
        np.testing.assert_allclose(bench.command, expected, rtol=0.0, atol=1e-9)
        assert np.all(np.abs(bench.command) <= most)
        assert np.all(np.abs(bench.momenta) <= np.maximum(np.abs(momentum), FULL * holds) + 1e-12)
        full_ticks += int(bench.allocation.wheels.full_ticks)
    assert 10 < full_ticks < 40


@pytest.mark.parametrize("sharing", SHARINGS)
@pytest.mark.parametrize("k", [0, 2])
def test_full_wheel_leaves_its_axis_alone(k: int, sharing: str) -> None:
    """Of three wheels one is full: the other axes lose nothing, and it can be slowed down."""
    bench = AllocationBench(np.eye(3), momenta=-19.8 * np.eye(3)[k], sharing=sharing)
    demand = np.array([0.5, 0.3, 0.2])
    np.testing.assert_allclose(bench.step(demand), np.where(np.arange(3) == k, 0.0, demand))
    np.testing.assert_allclose(bench.step(-demand), -demand, atol=1e-12)
    assert bench.allocation.wheels.full_ticks == 1.0


def test_momentum_goes_up_to_the_limit_and_not_beyond() -> None:
    bench = AllocationBench(null_gain=0.5, wheels={"max_momentum": [0.5]})
    bench.fly([1.2, 0.3, -0.4], 4000)
    assert np.abs(bench.momenta).max() == pytest.approx(FULL * 0.5, rel=1e-9)


def test_what_is_told_of_wheels_is_what_they_do() -> None:
    """Momentum as a share of each one's own limit; failed ones by their numbers."""
    wheels: dict[str, Any] = {"max_momentum": [20.0, 5.0, 10.0, 40.0]}
    bench = AllocationBench(momenta=[4.0, -4.0, 3.0, 10.0], wheels=wheels, failure_ticks=20)
    bench.step(np.zeros(3))
    found = diagnose(bench.allocation)
    assert (found.failed, found.summary) == ((), "")
    assert found.values["fullest_wheel"] == pytest.approx(0.8)
    assert found.values["wheel_axes"] == 3
    assert "failed" not in found.values
    bench.failed = {1, 3}
    bench.fly([0.3, 0.2, 0.1], 30)
    found = diagnose(bench.allocation)
    assert found.failed == ("wheel_2", "wheel_4")
    assert found.values["fullest_wheel"] == pytest.approx(abs(bench.momenta[2]) / 10.0, rel=1e-3)
    assert found.values["wheel_axes"] == 2
    assert found.values["failed"] == "wheel_2, wheel_4"
    assert "pulses" not in found.values
