"""What actuators can give: torque, momentum, propellant."""

from __future__ import annotations

import numpy as np
import pytest
from benches import WHEEL_AXES as PYRAMID
from benches import flat, hardware, random_thrusters
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog
from strategies import SEEDS

from space_robot.flight.capability import (
    ThrusterTorques,
    actuator_load,
    largest_momentum,
    largest_torque,
    wheel_shares,
)


def test_thrusters_help_wheels() -> None:
    """A pair about +x alone: about -x there are the wheels only, so that both ways is theirs."""
    thrusters = {
        "positions": [0.0, 1.0, 0.0, 0.0, -1.0, 0.0],
        "directions": [0.0, 0.0, 1.0, 0.0, 0.0, -1.0],
        "force": [5.0],
    }
    wheels = {"axes": flat(np.eye(3)), "max_torque": [1.0]}
    assert largest_torque(hardware(wheels=wheels, thrusters=thrusters))[0] == pytest.approx(1.0)
    both = {
        **thrusters,
        "positions": thrusters["positions"] * 2,
        "directions": [*thrusters["directions"], 0.0, 0.0, -1.0, 0.0, 0.0, 1.0],
    }
    assert largest_torque(hardware(wheels=wheels, thrusters=both))[0] == pytest.approx(11.0)
    each = {"axes": flat(np.eye(3)), "max_torque": [1.0, 2.0, 3.0], "max_momentum": [4.0, 5.0, 0.0]}
    np.testing.assert_allclose(largest_torque(hardware(wheels=each)), [1.0, 2.0, 3.0])
    np.testing.assert_allclose(largest_momentum(hardware(wheels=each).wheels), [4.0, 5.0, np.inf])


@settings(deadline=None, max_examples=30)
@given(SEEDS, st.integers(3, 12))
def test_the_least_propellant_is_the_linear_programmes(seed: int, count: int) -> None:
    rng = np.random.default_rng(seed)
    thrusters = random_thrusters(rng, count).thrusters
    rates, torques = thrusters.mass_flow, thrusters.torques
    np.testing.assert_allclose(
        rates, np.array(thrusters.force) / np.array(thrusters.specific_impulse) / 9.80665
    )
    wanted = rng.normal(size=(5, 3))
    found = ThrusterTorques.of(thrusters).propellant(wanted)
    for torque, rate in zip(wanted, found, strict=True):
        solved = linprog(rates, A_eq=torques.T, b_eq=torque, bounds=(0.0, None))
        assert rate == pytest.approx(solved.fun, rel=1e-6)
    assert ThrusterTorques.of(thrusters).propellant(np.zeros((1, 3))) == 0.0


def test_wheels_turn_their_momentum_with_the_base() -> None:
    """A base that turns steadily about z, with what its wheels hold about x, wants w x h about y.

    One wheel gives it; the wheels' friction comes on top.
    """
    wheels = {
        "axes": flat(np.eye(3)),
        "max_torque": [2.0],
        "max_momentum": [40.0],
        "rotor_inertia": [0.5],
        "initial_speed": [20.0, 0.0, 0.0],
        "coulomb": [0.0, 0.0, 0.1],
    }
    omega, still = np.array([[0.0, 0.0, 0.1]]), np.zeros((1, 3))
    load = actuator_load(hardware(wheels=wheels), still, np.array([[-10.0, 0.0, -4.0]]), omega)
    np.testing.assert_allclose(load.torque, [[0.0, 0.1 * 20.0, 0.0]])
    np.testing.assert_allclose(load.torque_share, [1.0])
    np.testing.assert_allclose(load.momentum_share, [0.5])


def test_couples_of_thrusters_about_one_axis_give_no_other_torque() -> None:
    """Two of 5 N at 1 m, one after the other about +z and -z."""
    couples = {
        "positions": [1.0, 0.0, 0.0, -1.0, 0.0, 0.0] * 2,
        "directions": [0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0],
        "force": [5.0],
    }
    still = np.zeros((3, 3))
    torque = np.array([[0.0, 0.0, 5.0], [0.0, 0.0, -20.0], [0.1, 0.0, 0.0]])
    load = actuator_load(hardware(thrusters=couples), torque, still, still)
    np.testing.assert_allclose(load.torque_share[:2], [0.5, 2.0])
    assert load.torque_share[2] > 1e3


@settings(deadline=None)
@given(SEEDS)
def test_the_share_of_a_pyramid_is_its_fullest_wheels(seed: int) -> None:
    """By the pseudoinverse, as the allocation shares it; about several axes it is more than about
    each."""
    rng = np.random.default_rng(seed)
    torque, still = rng.normal(size=(8, 3)), np.zeros((8, 3))
    found = hardware(wheels={"axes": PYRAMID, "max_torque": [0.2], "max_momentum": [7.0]})
    load = actuator_load(found, torque, torque, still)
    shares = np.abs(torque @ np.linalg.pinv(found.wheels.unit_axes.T).T).max(axis=1)
    np.testing.assert_allclose(load.torque_share, shares / 0.2)
    np.testing.assert_allclose(load.momentum_share, shares / 7.0)
    assert np.all(load.torque_share >= np.abs(torque).max(axis=1) / (0.8 / np.sqrt(3.0)) - 1e-9)
    without_limits = {"axes": PYRAMID, "max_torque": [0.0], "max_momentum": [0.0]}
    load = actuator_load(hardware(wheels=without_limits), torque, torque, still)
    assert not load.torque_share.any()
    assert not load.momentum_share.any()


@settings(deadline=None, max_examples=30)
@given(SEEDS)
def test_wheels_and_thrusters_give_what_the_linear_programme_says(seed: int) -> None:
    rng = np.random.default_rng(seed)
    wheels = {"axes": rng.normal(size=6).tolist(), "max_torque": rng.uniform(0.1, 5.0, 2).tolist()}
    thrusters = random_thrusters(rng, 5)
    found = hardware(wheels=wheels, thrusters=thrusters.thrusters.model_dump())
    wanted, still = rng.normal(size=(4, 3)), np.zeros((4, 3))
    load = actuator_load(found, wanted, still, still)
    limits: list[tuple[float, float | None]]
    limits = [(-limit, limit) for limit in found.wheels.limits("max_torque")]
    limits += [(0.0, 1.0)] * found.thruster_count + [(0.0, None)]
    columns = np.vstack([found.wheels.unit_axes, found.thrusters.torques]).T
    for torque, share in zip(wanted, load.torque_share, strict=True):
        solved = linprog(
            np.append(np.zeros(len(columns.T)), -1.0),
            A_eq=np.column_stack([columns, -torque]),
            b_eq=np.zeros(3),
            bounds=limits,
        )
        assert 1.0 / share == pytest.approx(-solved.fun, rel=1e-6)
    np.testing.assert_array_equal(load.momentum_share, 0.0)


@given(SEEDS, st.integers(3, 8))
def test_wheels_share_a_torque_by_least_squares_of_what_each_can_give(
    seed: int, count: int
) -> None:
    """``W A^T (A W A^T)^-1`` with the squares of the motors' torques as weights W."""
    rng = np.random.default_rng(seed)
    most, axes = rng.uniform(0.1, 5.0, count), rng.normal(size=(count, 3))
    found = hardware(wheels={"axes": flat(axes), "max_torque": most.tolist()}).wheels
    weighted = found.unit_axes.T * most**2
    expected = weighted.T @ np.linalg.inv(weighted @ found.unit_axes)
    np.testing.assert_allclose(wheel_shares(found), expected, rtol=1e-7, atol=1e-9)
