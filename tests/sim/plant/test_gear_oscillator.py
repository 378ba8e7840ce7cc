"""One joint with a gear as two masses on a spring: SciPy, frequencies, a motor without inertia.

Runge and Kutta's method of fourth order turns a swing of pulsation w by ``w h (1 - (w h)^4 / 120)``
in a step h, so over a time T it is late by ``w T (w h)^4 / 120`` rad. With the steps here, of 62.5
us, that is below 1e-10 for all oscillators flown, an order less than the 1e-9 asked of the plant.
"""

from __future__ import annotations

import numpy as np
import pytest
from geared_robots import HEAVY, PERIOD, GearedFlight, oscillator
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from space_robot_model.robot.tree import Gear

Array = NDArray[np.float64]

SUBSTEPS = 8
STEP = PERIOD / SUBSTEPS
TICKS = 1000
ROTOR, RATIO, STIFFNESS = 2e-5, 100.0, 150.0
MOTOR = RATIO**2 * ROTOR
"""B = N^2 J, kg m2 or kg."""
LINK, BASE = 0.5, 3.0
"""kg m2; the base's with the rotor, locked."""


def gear(damping: float = 0.0, ratio: float = RATIO) -> Gear:
    """Return a gear with the same B, whatever its ratio."""
    return Gear(MOTOR / ratio**2, ratio, STIFFNESS, damping)


def late(pulsation: float) -> float:
    """Return the error of the plant's method in the phase at the end, rad."""
    return pulsation * TICKS * PERIOD * (pulsation * STEP) ** 4 / 120.0


def inertia(base: float) -> Array:
    """Return the inertia matrix by turns of base, joint (against the base) and motor, about z.

    Of ``T = (base - J) p'^2 / 2 + J (p' + N m')^2 / 2 + link (p' + j')^2 / 2``.
    """
    own = RATIO * ROTOR
    return np.array([[base + LINK, LINK, own], [LINK, LINK, 0.0], [own, 0.0, MOTOR]])


@pytest.mark.parametrize("damping", [0.0, 0.4])
@pytest.mark.parametrize("viscous", [0.0, 0.3])
def test_a_free_base_a_link_and_a_motor_move_as_scipy_says(damping: float, viscous: float) -> None:
    """Stretched and thrown, under torques on base and motor, by DOP853 to 1e-9."""
    assert late(np.sqrt(STIFFNESS * (1.0 / MOTOR + 1.0 / LINK + 1.0 / BASE))) < 1e-10
    flight = GearedFlight(oscillator(gear(damping), LINK, BASE), SUBSTEPS, viscous=viscous)
    base, motor = 0.7, 2.0
    mass = inertia(BASE)
    start = np.array([0.0, 0.2, 0.25, 0.05, -0.3, 0.6])
    flight.positions[0], flight.motor_positions[0] = start[1:3]
    flight.base_velocities[5], flight.velocities[0], flight.motor_velocities[0] = start[3:]

    def derivative(_: float, y: Array) -> Array:
        _, joint_rate, motor_rate = y[3:]
        spring = STIFFNESS * (y[2] - y[1]) + damping * (motor_rate - joint_rate)
        force = np.array([base, spring, motor - spring - viscous * motor_rate])
        return np.concatenate([y[3:], np.linalg.solve(mass, force)])

    exact = solve_ivp(derivative, (0.0, TICKS * PERIOD), start, "DOP853", rtol=1e-13, atol=1e-15)
    truth = flight.fly([0.0, 0.0, base, motor], TICKS)
    turn = 2.0 * np.arctan2(truth.quaternion[3], truth.quaternion[0])
    actual = [
        *(turn, truth.joint_positions[0], truth.motor_positions[0]),
        *(truth.omega_base[2], truth.joint_velocities[0], truth.motor_velocities[0]),
    ]
    end = exact.y[:, -1]
    assert np.abs(end - start).min() > 1e-2
    np.testing.assert_allclose(actual, end, rtol=1e-9, atol=0.0)


def pole(base_inertia: float, robot_gear: Gear, joint: str = "revolute") -> complex:
    """Return the eigenvalue (1/s, Im > 0) of the deflection's motion, from two flights.

    Deflection and its rate after the time are a linear map of those before it.
    """
    duration = 0.0
    columns = []
    for deflection, rate in ((1e-3, 0.0), (0.0, 0.05)):
        flight = GearedFlight(oscillator(robot_gear, LINK, base_inertia, joint), SUBSTEPS)
        flight.motor_positions[0], flight.motor_velocities[0] = deflection, rate
        duration = 100 * PERIOD
        truth = flight.rest(100)
        columns.append(
            [
                truth.motor_positions[0] - truth.joint_positions[0],
                truth.motor_velocities[0] - truth.joint_velocities[0],
            ]
        )
    after = np.transpose(columns) / np.array([1e-3, 0.05])
    eigenvalues = np.log(np.linalg.eigvals(after).astype(complex)) / duration
    return complex(eigenvalues[np.argmax(eigenvalues.imag)])


@pytest.mark.parametrize("damping", [0.0, 0.4])
@pytest.mark.parametrize("joint", ["revolute", "prismatic"])
@pytest.mark.parametrize("ratio", [RATIO, 1.0])
def test_on_a_fixed_base_it_swings_with_the_two_masses_frequency(
    damping: float, joint: str, ratio: float
) -> None:
    """``s^2 + (1/B + 1/I) (D s + K) = 0``: without damping ``sqrt(K (1/B + 1/I))``.

    With a ratio of 1 the rotor is a wheel on a spring.
    """
    lighter = 1.0 / MOTOR + 1.0 / LINK
    pulsation = np.sqrt(STIFFNESS * lighter)
    assert np.pi > pulsation * 100 * PERIOD > 1.0, "the logarithm's branch"
    decay = 0.5 * damping * lighter
    expected = complex(-decay, np.sqrt(pulsation**2 - decay**2))
    actual = pole(HEAVY, gear(damping, ratio), joint)
    assert abs(actual - expected) < 1e-9 * abs(expected)
    if damping == 0.0:
        assert expected.imag == pulsation
        assert abs(actual.real) < 1e-9 * pulsation


def test_on_a_free_base_it_swings_faster() -> None:
    """By the eigenvalues of the matrices of the three turns; Spong's model has another value."""
    mass = inertia(BASE)
    stretch = np.array([0.0, -1.0, 1.0])
    pulsation = np.sqrt(STIFFNESS * stretch @ np.linalg.solve(mass, stretch))
    assert abs(pole(BASE, gear()) - 1j * pulsation) < 1e-9 * pulsation
    mass[0, 2] = mass[2, 0] = 0.0  # no z . wdot_p
    without = np.sqrt(STIFFNESS * stretch @ np.linalg.solve(mass, stretch))
    assert abs(without - pulsation) > 1e-4 * pulsation


def test_without_rotor_inertia_the_motor_follows_torque_and_friction() -> None:
    """``tau = tau_s + f``: what is left of its motion is of first order, distance as the rotor's.

    A quarter of the rotor's inertia brings the flight four times as near to that of a motor without
    any, whose angle is the solution of a differential equation of first order.
    """
    damping, viscous, torque = 0.3, 0.5, 2.0
    light = np.array([16.0, 4.0, 1.0]) * 1e-5

    def derivative(_: float, y: Array) -> Array:
        link, rate, motor = y
        motor_rate = torque - STIFFNESS * (motor - link) + damping * rate
        motor_rate /= damping + viscous
        spring = STIFFNESS * (motor - link) + damping * (motor_rate - rate)
        return np.array([rate, spring / LINK, motor_rate])

    duration = 400 * PERIOD
    exact = solve_ivp(derivative, (0.0, duration), np.zeros(3), "DOP853", rtol=1e-13, atol=1e-15)
    distances, unbalanced = [], []
    for reflected in light:
        robot = oscillator(Gear(reflected / RATIO**2, RATIO, STIFFNESS, damping), LINK)
        flight = GearedFlight(robot, 2 * SUBSTEPS, viscous=viscous)
        truth = flight.fly([0.0, 0.0, 0.0, torque], 400)
        link, motor = truth.joint_positions[0], truth.motor_positions[0]
        distances.append(abs(motor - exact.y[2, -1]))
        spring = STIFFNESS * (motor - link)
        spring += damping * (truth.motor_velocities[0] - truth.joint_velocities[0])
        unbalanced.append(abs(torque - spring - viscous * truth.motor_velocities[0]))
    assert exact.y[2, -1] > 0.05
    assert distances[-1] < 1e-4
    assert unbalanced[-1] < 1e-3 * torque
    for errors in (distances, unbalanced):
        np.testing.assert_allclose(np.divide(errors[:-1], errors[1:]), 4.0, rtol=0.05)
