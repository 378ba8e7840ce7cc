"""Unloading by magnetic torquers: the cross-product law, its limits, and what wheels give then."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from wheel_layouts import PYRAMID, unit

from space_robot_control.allocation.allocation import Allocation, allocate
from space_robot_control.allocation.diagnosis import diagnose
from space_robot_control.allocation.magnetic_torquers import AssumedTorquers, dump_momentum
from space_robot_control.allocation.settings import AllocationSettings
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.magnetic_torquers import MagneticTorquerSettings
from space_robot_msgs_py.samples import MOST_TORQUERS

Array = NDArray[np.float64]

PERIOD, INERTIA = 5e-4, 0.02
SEEDS = st.integers(0, 2**31 - 1)
COUNTS = st.integers(3, MOST_TORQUERS)
FIELDS = st.floats(1e-6, 1.0)
"""Sizes of a magnetic field, T; that of the Earth is some 3e-5."""
GAINS = st.floats(1e-4, 10.0)
UNBOUNDED = 1e9
"""A m2: no dipole reaches it."""
COUPLES = {
    "positions": [1, 0, 0, -1, 0, 0, 1, 0, 0, -1, 0, 0] * 3,
    "directions": [
        *(0, 1, 0, 0, -1, 0, 0, -1, 0, 0, 1, 0),
        *(0, 0, 1, 0, 0, -1, 0, 0, -1, 0, 0, 1),
        *(0, 1, 1, 0, 1, -1, 0, -1, -1, 0, -1, 1),
    ],
}


def torquers_of(
    axes: Array, most: Any = UNBOUNDED, gain: float = 0.002, dump: Any = "all"
) -> AssumedTorquers:
    most = np.broadcast_to(np.asarray(most, float), len(axes)).tolist()
    assumed = MagneticTorquerSettings(axes=axes.ravel().tolist(), max_dipole=most)
    return AssumedTorquers.build(1, assumed, AllocationSettings(magnetic_gain=gain, dump=dump))


def dumped(torquers: AssumedTorquers, momentum: Array, field: Array) -> tuple[Array, Array]:
    """Return the dipole of each torquer, A m2, and their torque, N m."""
    torquers.magnetic_field[:] = field
    dump_momentum(torquers, *momentum)
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
    """``-k (h - (h . b) b)``, whatever the axes; m has no part along the field, without effect."""
    rng = np.random.default_rng(seed)
    axes, momentum = random_axes(rng, count), 10.0 * rng.normal(size=3)
    b = unit(rng.normal(size=(1, 3)))[0]
    dipoles, torque = dumped(torquers_of(axes, gain=gain), momentum, strength * b)
    size = gain * np.linalg.norm(momentum)
    across = momentum - (momentum @ b) * b
    np.testing.assert_allclose(torque, -gain * across, rtol=0.0, atol=1e-12 * size)
    moment = dipoles @ axes
    np.testing.assert_allclose(np.cross(moment, strength * b), torque, rtol=0, atol=1e-12 * size)
    assert abs(moment @ b) < 1e-12 * size / strength


@given(SEEDS, COUNTS)
def test_torquers_share_the_dipole_by_least_squares(seed: int, count: int) -> None:
    """No other dipoles with the same moment have a smaller sum of squares."""
    rng = np.random.default_rng(seed)
    axes, field = random_axes(rng, count), 3e-5 * rng.normal(size=3)
    momentum = rng.normal(size=3)
    dipoles, _ = dumped(torquers_of(axes), momentum, field)
    moment = 0.002 * np.cross(momentum, field) / (field @ field)
    np.testing.assert_allclose(
        dipoles, np.linalg.lstsq(axes.T, moment)[0], rtol=0.0, atol=1e-10 * np.abs(dipoles).max()
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


@given(SEEDS, st.integers(1, MOST_TORQUERS))
def test_no_field_or_no_momentum_is_no_dipole(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    torquers = torquers_of(unit(rng.normal(size=(count, 3))), 400.0)
    field, momentum = 3e-5 * rng.normal(size=3), rng.normal(size=3)
    for h, b in ((momentum, np.zeros(3)), (np.zeros(3), field), (momentum, -0.0 * field)):
        dipoles, torque = dumped(torquers, h, b)
        np.testing.assert_array_equal(dipoles, 0.0)
        np.testing.assert_array_equal(torque, 0.0)


@given(st.floats(-320.0, -10.0), SEEDS)
def test_a_field_of_any_size_gives_numbers(exponent: float, seed: int) -> None:
    """A magnetometer that reads next to nothing: its square may not even be a normal number."""
    rng = np.random.default_rng(seed)
    torquers = torquers_of(np.eye(3), 400.0)
    field = 10.0**exponent * rng.choice([-1.0, 0.0, 1.0], 3)
    dipoles, torque = dumped(torquers, 10.0 * rng.normal(size=3), field)
    assert (np.abs(dipoles) <= 400.0).all()
    assert (np.abs(torque) <= 1e-2).all()


def test_momentum_along_the_field_stays() -> None:
    field = 3e-5 * np.array([0.6, 0.0, 0.8])
    dipoles, torque = dumped(torquers_of(np.eye(3), 400.0), 2e5 * field, field)
    np.testing.assert_allclose(dipoles, 0.0, atol=1e-10)
    np.testing.assert_allclose(torque, 0.0, atol=1e-15)


class Base:
    """The allocation of a base that does not turn, with wheels and torquers."""

    def __init__(
        self,
        most: float = UNBOUNDED,
        momenta: Any = (8.0, -5.0, 3.0, 1.0),
        has_thrusters: bool = False,
        **settings: Any,
    ) -> None:
        parts: dict[str, Any] = {
            "wheels": {
                "axes": PYRAMID.ravel().tolist(),
                "rotor_inertia": [INERTIA],
                "max_torque": [1.0],
                "max_momentum": [20.0],
            },
            "magnetic_torquers": {"axes": np.eye(3).ravel().tolist(), "max_dipole": [most]},
        }
        if has_thrusters:
            parts["thrusters"] = COUPLES
        assumed = BaseActuatorSettings.model_validate({"base_actuation": "hardware", **parts})
        options = {"null_gain": 0.0, **settings}
        self.allocation = Allocation.build(1, assumed, AllocationSettings(**options), PERIOD)
        self.axes, self.momenta = assumed.wheels.unit_axes, np.array(momenta, float)
        self.first, self.tick = assumed.wheel_count + assumed.thruster_count, 0

    @property
    def momentum(self) -> Array:
        return np.asarray(self.momenta @ self.axes)

    def ask(self, demand: Any, field: Any) -> tuple[Array, Array, Array]:
        """Return the torques of wheels and torquers on the base, N m, and the dipoles, A m2."""
        allocation = self.allocation
        allocation.reported_speeds[:4] = self.momenta / INERTIA
        allocation.torquers.magnetic_field[:], allocation.demand[:] = field, demand
        allocate(allocation, float(self.tick))
        motors = allocation.command[:4].copy()
        allocation.reported_torques[:4] = motors
        self.tick += 1
        self.momenta += PERIOD * motors
        dipoles = allocation.command[self.first : self.first + 3].copy()
        return -motors @ self.axes, np.cross(dipoles, field), dipoles


@pytest.mark.parametrize("most", [UNBOUNDED, 3.0])
@pytest.mark.parametrize("seed", range(5))
def test_wheels_and_torquers_give_the_demand_together(seed: int, most: float) -> None:
    """To rounding, the torquers at their limits or not: wheels hold against them."""
    rng, base = np.random.default_rng(seed), Base(most)
    for _ in range(20):
        demand, field = 0.2 * rng.normal(size=3), 3e-5 * rng.normal(size=3)
        momentum = base.momentum
        of_wheels, of_torquers, dipoles = base.ask(demand, field)
        np.testing.assert_allclose(of_wheels + of_torquers, demand, rtol=0.0, atol=1e-14)
        b = field / np.linalg.norm(field)
        across = momentum - (momentum @ b) * b
        if most == UNBOUNDED:
            np.testing.assert_allclose(of_torquers, -0.002 * across, rtol=0.0, atol=1e-14)
        else:
            assert np.abs(dipoles).max() == pytest.approx(most)
        np.testing.assert_allclose(
            base.allocation.torquers.torque, of_torquers, rtol=0.0, atol=1e-16
        )


@pytest.mark.parametrize(
    ("dump", "magnetic", "by_thrusters"),
    [
        ("none", False, False),
        ("magnetic", True, False),
        ("thrusters", False, True),
        ("all", True, True),
    ],
)
def test_who_unloads_is_chosen(dump: str, magnetic: bool, by_thrusters: bool) -> None:
    """With wheels above the threshold of thrusters."""
    base = Base(has_thrusters=True, dump=dump, momenta=(19.0, 0.0, -19.0, 0.0), unload_above=0.5)
    _, of_torquers, dipoles = base.ask(np.zeros(3), [1e-5, 2e-5, 2e-5])
    assert bool(dipoles.any()) is bool(of_torquers.any()) is magnetic
    assert bool(base.allocation.unloading.is_active) is by_thrusters
    assert bool(np.any(base.allocation.of_thrusters)) is by_thrusters


def test_without_another_choice_all_that_there_are_unload() -> None:
    settings = AllocationSettings()
    assert settings.torquers_unload
    assert settings.thrusters_unload


@pytest.mark.parametrize("gain", [0.0, 0.5])
def test_the_gain_is_a_rate(gain: float) -> None:
    """``h exp(-k t)`` across a field that does not turn; what is along it stays."""
    base = Base(magnetic_gain=gain, momenta=(0.8, -0.5, 0.3, 0.1))
    field, start, ticks = np.array([0.0, 0.0, 3e-5]), base.momentum, 2000
    for _ in range(ticks):
        base.ask(np.zeros(3), field)
    left = (1.0 - gain * PERIOD) ** ticks
    np.testing.assert_allclose(base.momentum, start * [left, left, 1.0], rtol=0.0, atol=1e-11)


def test_the_wheels_are_asked_for_no_more_than_they_have() -> None:
    """A demand and an unloading that together exceed the motors' torques keep their direction."""
    base = Base(magnetic_gain=10.0)
    of_wheels, of_torquers, _ = base.ask([0.3, 0.0, 0.0], [0.0, 0.0, 3e-5])
    assert np.abs(base.allocation.command[:4]).max() == 1.0
    np.testing.assert_allclose(
        np.cross(of_wheels, np.array([0.3, 0.0, 0.0]) - of_torquers), 0.0, atol=1e-12
    )


def test_the_diagnosis_tells_the_largest_dipole() -> None:
    base = Base(25.0)
    assert diagnose(base.allocation).values["largest_dipole"] == 0.0
    base.ask(np.zeros(3), [0.0, 1e-5, 3e-5])
    assert diagnose(base.allocation).values["largest_dipole"] == pytest.approx(25.0)
    without = Allocation.build(
        1,
        BaseActuatorSettings(base_actuation="hardware", wheels={"axes": PYRAMID.ravel().tolist()}),
        AllocationSettings(),
        PERIOD,
    )
    assert "largest_dipole" not in diagnose(without).values


@pytest.mark.parametrize("wrong", [{"dump": "wheels"}, {"magnetic_gain": -1e-3}, {"dump": ""}])
def test_settings_that_cannot_be(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        AllocationSettings(**wrong)
