"""Unloading by magnetic torquers: the cross-product law, its limits, and what wheels give then."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from allocation_bench import AllocationBench, couples, unit
from hypothesis import given
from hypothesis import strategies as st

from space_robot_control.allocation.settings import AllocationSettings
from space_robot_control.allocation.unloading import AssumedTorquers, dump_momentum
from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import MagneticTorquerSettings
from space_robot_msgs_py.samples import MOST_TORQUERS

SEEDS = st.integers(0, 2**31 - 1)
COUNTS = st.integers(3, MOST_TORQUERS)
FIELDS = st.floats(1e-6, 1.0)
"""Sizes of a magnetic field, T; that of the Earth is some 3e-5."""
GAINS = st.floats(1e-4, 10.0)
UNBOUNDED = 1e9
"""A m2: no dipole reaches it."""


def torquers_of(
    axes: Array, most: Any = UNBOUNDED, gain: float = 0.002, dump: Any = "all"
) -> AssumedTorquers:
    most = np.broadcast_to(np.asarray(most, float), len(axes)).tolist()
    assumed = MagneticTorquerSettings(axes=axes.ravel().tolist(), max_dipole=most)
    return AssumedTorquers.build(1, assumed, AllocationSettings(magnetic_gain=gain, dump=dump))


def dumped(torquers: AssumedTorquers, momentum: Array, field: Array) -> tuple[Array, Array]:
    """Return the dipole of each torquer, A m2, and their torque, N m."""
    torquers.magnetic_field[:] = field
    dump_momentum(torquers, tuple(momentum))
    return torquers.dipole[: int(torquers.count)].copy(), torquers.torque.copy()


def random_axes(rng: np.random.Generator, count: int) -> Array:
    """Return unit vectors (count, 3) that span all directions well."""
    while True:
        axes = unit(rng.normal(size=(count, 3)))
        if np.linalg.svd(axes, compute_uv=False)[2] > 0.1:
            return axes


@given(SEEDS, COUNTS, FIELDS, GAINS)
def test_the_torque_is_against_the_momentum_across_the_field(
    seed: int, count: int, strength: float, gain: float
) -> None:
    """``-k (h - (h . b) b)``, whatever the axes, by the dipoles with the least sum of squares."""
    rng = np.random.default_rng(seed)
    axes, momentum = random_axes(rng, count), 10.0 * rng.normal(size=3)
    b = unit(rng.normal(size=(1, 3)))[0]
    dipoles, torque = dumped(torquers_of(axes, gain=gain), momentum, strength * b)
    size = gain * np.linalg.norm(momentum)
    across = momentum - (momentum @ b) * b
    np.testing.assert_allclose(torque, -gain * across, rtol=0.0, atol=1e-12 * size)
    moment = gain * np.cross(momentum, b) / strength
    np.testing.assert_allclose(
        dipoles, np.linalg.lstsq(axes.T, moment)[0], rtol=0.0, atol=1e-10 * size / strength
    )


@given(SEEDS, COUNTS, st.floats(0.0, 3.0))
def test_beyond_the_largest_dipole_the_direction_stays(
    seed: int, count: int, decades: float
) -> None:
    """All are scaled by one number: the first at its limit is at it exactly, none beyond."""
    rng = np.random.default_rng(seed)
    axes, field, momentum = random_axes(rng, count), 3e-5 * rng.normal(size=3), rng.normal(size=3)
    free, free_torque = dumped(torquers_of(axes), momentum, field)
    most = np.abs(free).max() * 10.0**-decades * rng.uniform(0.5, 2.0, count)
    dipoles, torque = dumped(torquers_of(axes, most), momentum, field)
    share = min(1.0, float(np.min(most / np.maximum(np.abs(free), 1e-300))))
    np.testing.assert_allclose(dipoles, share * free, rtol=1e-12, atol=1e-12 * np.abs(free).max())
    np.testing.assert_allclose(
        torque, share * free_torque, rtol=0.0, atol=1e-12 * np.linalg.norm(free_torque)
    )
    loads = np.abs(dipoles) / most
    assert loads.max() <= 1.0
    if share < 1.0:
        assert loads.max() == 1.0


@given(SEEDS, st.integers(1, MOST_TORQUERS), st.floats(1e-9, 1.0), st.floats(-3.0, 6.0), GAINS)
def test_the_momentum_never_grows(
    seed: int, count: int, strength: float, decades: float, gain: float
) -> None:
    """``h . torque <= 0``, also with one or two torquers, and at any largest dipoles.

    With fewer than three, their moment m' is the projection of m on the plane or line of their
    axes, scaled: ``h . (m' x B) = -m' . m |B|^2 / k``, and ``m' . m >= 0``.
    """
    rng = np.random.default_rng(seed)
    axes = unit(rng.normal(size=(count, 3)))
    field = strength * unit(rng.normal(size=(1, 3)))[0]
    momentum = 10.0**decades * rng.normal(size=3)
    torquers = torquers_of(axes, 10.0 ** rng.uniform(0.0, 4.0, count), gain)
    _, torque = dumped(torquers, momentum, field)
    sizes = np.linalg.norm(momentum) * np.linalg.norm(torque)
    assert momentum @ torque <= 1e-9 * sizes


@given(SEEDS, st.integers(1, MOST_TORQUERS), st.floats(-320.0, -10.0))
def test_no_momentum_or_next_to_no_field_gives_numbers(
    seed: int, count: int, exponent: float
) -> None:
    """The square of what a magnetometer reads may not even be a normal number."""
    rng = np.random.default_rng(seed)
    torquers = torquers_of(unit(rng.normal(size=(count, 3))), 400.0)
    field, momentum = 3e-5 * rng.normal(size=3), rng.normal(size=3)
    for h, b in ((momentum, np.zeros(3)), (np.zeros(3), field), (momentum, -0.0 * field)):
        for numbers in dumped(torquers, h, b):
            np.testing.assert_array_equal(numbers, 0.0)
    field = 10.0**exponent * rng.choice([-1.0, 0.0, 1.0], 3)
    dipoles, torque = dumped(torquers, 10.0 * momentum, field)
    assert (np.abs(dipoles) <= 400.0).all()
    assert (np.abs(torque) <= 1e-2).all()


# With wheels


def bench_of(
    most: float = UNBOUNDED, momenta: Any = (8.0, -5.0, 3.0, 1.0), **settings: Any
) -> AllocationBench:
    options = {"null_gain": 0.0, **settings}
    return AllocationBench(momenta=momenta, largest_dipole=most, **options)


@pytest.mark.parametrize("most", [UNBOUNDED, 3.0])
@pytest.mark.parametrize("seed", range(3))
def test_wheels_and_torquers_give_the_demand_together(seed: int, most: float) -> None:
    """To rounding, the torquers at their limits or not: wheels hold against them."""
    rng, bench = np.random.default_rng(seed), bench_of(most)
    for _ in range(20):
        demand, field = 0.2 * rng.normal(size=3), 3e-5 * rng.normal(size=3)
        momentum = bench.momenta @ bench.axes
        np.testing.assert_allclose(bench.step(demand, field), demand, rtol=0.0, atol=1e-14)
        of_torquers = bench.of_torquers
        b = field / np.linalg.norm(field)
        across = momentum - (momentum @ b) * b
        if most == UNBOUNDED:
            np.testing.assert_allclose(of_torquers, -0.002 * across, rtol=0.0, atol=1e-14)
        else:
            assert np.abs(bench.dipoles).max() == pytest.approx(most)
        np.testing.assert_allclose(bench.allocation.torquers.torque, of_torquers, atol=1e-16)


@pytest.mark.parametrize(
    ("dump", "magnetic", "by_thrusters"),
    [
        ("none", False, False),
        ("magnetic", True, False),
        ("thrusters", False, True),
        ("all", True, True),
        (None, True, True),
    ],
)
def test_who_unloads_is_chosen(dump: str | None, magnetic: bool, by_thrusters: bool) -> None:
    """With wheels above the threshold of thrusters; without a choice all that there are."""
    choice = {"dump": dump} if dump else {}
    momenta = (19.0, 0.0, -19.0, 0.0)
    bench = bench_of(momenta=momenta, thrusters=couples(), unload_above=0.5, **choice)
    bench.step(np.zeros(3), [1e-5, 2e-5, 2e-5])
    assert bool(bench.dipoles.any()) is bool(bench.of_torquers.any()) is magnetic
    assert bool(bench.allocation.unloading.is_active) is by_thrusters
    assert bool(np.any(bench.allocation.thruster_demand)) is by_thrusters


def test_the_wheels_are_asked_for_no_more_than_they_have() -> None:
    """A demand and an unloading that together exceed the motors' torques keep their direction."""
    bench, demand = bench_of(magnetic_gain=10.0), np.array([0.3, 0.0, 0.0])
    of_wheels = bench.step(demand, [0.0, 0.0, 3e-5]) - bench.of_torquers
    assert np.abs(bench.command[:4]).max() == 1.0
    np.testing.assert_allclose(np.cross(of_wheels, demand - bench.of_torquers), 0.0, atol=1e-12)
