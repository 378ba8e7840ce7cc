"""Magnetic torquers: the torque m x B of their dipoles, and the momentum that it gives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from actuator_bench import Bench, N
from conservation import momentum
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray
from oracles import rotation_of
from orbiting_robots import KEPLER, LOCKED, orbiting_plant, set_motion
from paths import CONFIG

from space_robot_model.hardware.wheels import WheelSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import MOST_TORQUERS, Command
from space_robot_sim.plant.plant import Plant

Array = NDArray[np.float64]

PAPER = Robot.from_yaml(CONFIG / "robots/paper.yaml")
SEEDS = st.integers(0, 2**31 - 1)
PYRAMID = [1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0]
WHEELS = {"axes": PYRAMID, "rotor_inertia": [0.03], "initial_speed": [50.0, -20.0, 30.0, 90.0]}
FIELD_ONLY = {"gravity": {"gradient": False}, "magnetism": {"strength": 3e-5}}
"""T at the magnetic equator."""


def bench(axes: Array, most: Array, **more: Any) -> Bench:
    return Bench(
        base_actuation="hardware",
        wheels=WHEELS,
        magnetic_torquers={"axes": axes.ravel().tolist(), "max_dipole": most.tolist()},
        **more,
    )


def torque_of(axes: Array, dipoles: Array, field: Array) -> Array:
    """Return ``m x B``, N m, of dipoles (M,), A m2, along axes (M, 3) of any length."""
    unit = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    return np.asarray(np.cross(dipoles @ unit, field))


@given(SEEDS, st.integers(1, MOST_TORQUERS))
def test_the_base_gets_m_cross_b_of_dipoles_up_to_the_largest(seed: int, count: int) -> None:
    """Added to what its wheels give; the wheels' command is not mixed up with theirs."""
    rng = np.random.default_rng(seed)
    axes, most = rng.normal(size=(count, 3)), rng.uniform(1.0, 400.0, count)
    actuators = bench(axes, most)
    for _ in range(5):
        field = 3e-5 * rng.normal(size=3)
        motors, asked = rng.normal(size=4), 2.0 * most * rng.normal(size=count)
        actuators.truth.magnetic_field[:] = field
        reported, torque = actuators.act(np.concatenate([rng.normal(size=N + 3), motors, asked]))
        expected = torque_of(axes, np.clip(asked, -most, most), field)
        np.testing.assert_allclose(
            actuators.record.base_wrench[3:], expected, rtol=0.0, atol=1e-14 * most.sum()
        )
        np.testing.assert_array_equal(actuators.record.base_wrench[:3], 0.0)
        unit = actuators.settings.wheels.unit_axes
        np.testing.assert_allclose(torque[:3], expected - motors @ unit, rtol=0.0, atol=1e-13)
        np.testing.assert_array_equal(reported, torque)


@pytest.mark.parametrize(
    ("asked", "given_dipole"),
    [
        (np.nan, 0.0),
        (np.inf, 20.0),
        (-np.inf, -20.0),
        (1e300, 20.0),
        (-20.0, -20.0),
        (-20.000001, -20.0),
        (5e-324, 5e-324),
        (0.0, 0.0),
    ],
)
def test_a_dipole_is_bounded_and_that_of_no_number_is_zero(
    asked: float, given_dipole: float
) -> None:
    """The other torquer is not touched by it."""
    axes, field = np.eye(3)[:2], np.array([0.0, 0.0, 2e-5])
    actuators = bench(axes, np.array([20.0, 7.0]))
    actuators.truth.magnetic_field[:] = field
    actuators.ask(0.0, 0.0, 0.0, 0.0, asked, 7.5)
    expected = np.cross([given_dipole, 7.0, 0.0], field)
    np.testing.assert_allclose(actuators.truth.applied_torque[:3], expected, rtol=1e-15)


def test_without_a_field_there_is_no_torque() -> None:
    actuators = bench(np.eye(3), np.full(3, 50.0))
    actuators.ask(0.0, 0.0, 0.0, 0.0, 10.0, 20.0, 30.0)
    np.testing.assert_array_equal(actuators.truth.applied_torque[:3], 0.0)


def test_dipoles_are_late_as_all_of_a_command() -> None:
    actuators = bench(np.eye(3), np.full(3, 50.0), command_latency_ticks=2)
    actuators.truth.magnetic_field[:] = [0.0, 0.0, 1e-5]
    for tick in range(5):
        actuators.ask(0.0, 0.0, 0.0, 0.0, tick + 1.0, 0.0, 0.0)
        late = max(0, tick - 1)
        assert actuators.truth.applied_torque[1] == -1e-5 * late


def turning_plant(has_torquers: bool = True, **settings: Any) -> Plant:
    """A rigid robot with wheels, and torquers or none, that turns in a magnetic field."""
    torquers = {"axes": np.eye(3).ravel().tolist(), "max_dipole": [300.0]}
    plant = orbiting_plant(
        PAPER,
        0.01,
        orbital_elements={"height": 420e3, "inclination_deg": 51.6, "anomaly_deg": 20.0},
        base_actuation="hardware",
        wheels=WHEELS,
        initial_joints_deg=[0.0, 120.0, 220.0, 0.0, -10.0, 0.0],
        initial_quaternion=[0.3, -0.8, 0.4, 0.2],
        friction=LOCKED,
        **({"magnetic_torquers": torquers} if has_torquers else {}),
        **{**FIELD_ONLY, **settings},
    )
    set_motion(plant, position=[0.2, -0.1, 0.3], omega=[0.03, -0.02, 0.04])
    return plant


def test_the_plants_momentum_grows_by_the_integral_of_m_cross_b() -> None:
    """On inertial axes, of robot and wheels; and no force comes of it.

    Each dipole is held on the base's axes over its tick, with the field of the tick's begin; the
    torque turns with the base, whose attitude in the middle of the tick is close enough.
    """
    plant, rng = turning_plant(), np.random.default_rng(2)
    wheels = WheelSettings.model_validate(WHEELS)
    impulse, start = np.zeros(3), momentum(PAPER, plant.truth, wheels)
    for tick in range(300):
        dipoles = 300.0 * rng.uniform(-1.0, 1.0, 3)
        motors = 0.05 * rng.normal(size=4)
        held = np.cross(dipoles, plant.truth.magnetic_field)
        before = rotation_of(plant.truth.quaternion).apply(held)
        plant.step(Command(tick, np.concatenate([np.zeros(N + 3), motors, dipoles])))
        after = rotation_of(plant.truth.quaternion).apply(held)
        impulse += 0.5 * plant.period * (before + after)
        expected = held - motors @ wheels.unit_axes
        np.testing.assert_allclose(plant.truth.applied_torque[:3], expected, rtol=0, atol=1e-14)
        np.testing.assert_array_equal(plant.state.applied_torque, plant.truth.applied_torque)
    end = momentum(PAPER, plant.truth, wheels)
    size = np.linalg.norm(impulse)
    assert size > 1e-3
    # the trapezoidal rule's error: (omega period)^2 / 12, 2.4e-8 of each tick's impulse
    np.testing.assert_allclose(end[1] - start[1], impulse, rtol=0.0, atol=3e-8 * size)
    assert np.linalg.norm(end[0] - start[0]) < 1e-12


def test_the_field_is_that_at_the_begin_of_a_tick_and_residual_dipoles_add() -> None:
    """A residual dipole is not an actuator's: it is no part of the applied torque."""
    residual = np.array([5.0, -3.0, 2.0])
    plant = turning_plant(magnetism={"strength": 3e-5, "residual_dipole": residual.tolist()})
    field = plant.truth.magnetic_field.copy()
    np.testing.assert_allclose(
        rotation_of(plant.truth.quaternion).inv().apply(plant.truth.external_torques[9:]),
        np.cross(residual, field),
        rtol=0.0,
        atol=1e-18,
    )
    dipoles = np.array([100.0, 0.0, -50.0])
    plant.step(Command(0, np.concatenate([np.zeros(N + 3), np.zeros(4), dipoles])))
    np.testing.assert_allclose(
        plant.truth.applied_torque[:3], np.cross(dipoles, field), rtol=0.0, atol=1e-18
    )
    assert (plant.truth.magnetic_field != field).all()


def test_torquers_at_rest_change_no_bit() -> None:
    """A flight in which they are asked for nothing is that of a base without them."""
    with_torquers, without = turning_plant(), turning_plant(has_torquers=False)
    for tick in range(20):
        motors = np.concatenate([np.zeros(N + 3), [0.1, -0.2, 0.3, 0.0]])
        without.step(Command(tick, motors))
        with_torquers.step(Command(tick, np.concatenate([motors, np.zeros(3)])))
    np.testing.assert_array_equal(with_torquers.truth.numbers, without.truth.numbers)


def test_gravity_does_not_change_what_torquers_give() -> None:
    """The wrench of the actuators is the same in any gravity."""
    plants = [
        turning_plant(gravity=gravity) for gravity in ({"gradient": False, "j2": False}, KEPLER)
    ]
    for plant in plants:
        plant.step(Command(0, np.array([*np.zeros(N + 7), 100.0, -200.0, 299.0])))
    one, other = (plant.truth.applied_torque for plant in plants)
    np.testing.assert_array_equal(one, other)
