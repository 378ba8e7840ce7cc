"""The plant's flights of trees, springs in them, against SciPy on Pinocchio's dynamics."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from tree_flight import PERIOD, SEEDS, TORQUE, TreeFlight, tree

from space_robot_sim.environment.disturbance import DisturbanceSettings

Array = NDArray[np.float64]


@pytest.mark.parametrize("seed", SEEDS)
def test_step_agrees_with_an_adaptive_integrator(seed: int) -> None:
    """0.3 s in two holds of torque: motors, springs with damping, friction of the robot's own.

    Base and motors are disturbed, each by a sine of its own.
    """
    disturbance = DisturbanceSettings(
        scale=1.0,
        base_amplitude=30.0,
        inner_amplitude=3.0,
        base_frequencies=[1.5, 0.0],
        inner_frequencies=[3.0, 0.0],
    )
    flight = TreeFlight(tree(seed), viscous=0.2, disturbance=disturbance)
    x = np.concatenate(flight.configuration())
    nq, hold = flight.model.nq, 300 * PERIOD

    def disturbed(t: float) -> Array:
        base, motors = 30.0 * np.sin(3.0 * np.pi * t), 3.0 * np.sin(6.0 * np.pi * t)
        return np.array([base] * 3 + [motors] * flight.robot.n)

    for begin, torque in ((0.0, TORQUE), (hold, -0.5 * TORQUE[::-1])):
        solution = solve_ivp(
            lambda t, x, torque=torque: flight.derivative(torque, x[:nq], x[nq:], disturbed(t)),
            (begin, begin + hold),
            x,
            method="DOP853",
            rtol=1e-12,
            atol=1e-12,
        )
        x = solution.y[:, -1]
        flight.fly(torque, 300)
        actual = np.concatenate(flight.configuration())
        actual[3:7] *= np.sign(actual[3:7] @ x[3:7])
        np.testing.assert_allclose(actual, x, rtol=0.0, atol=1e-9 * np.abs(x).max())
    assert np.abs(flight.joints()[1][flight.robot.n :]).max() > 0.05, "springs must swing"


@pytest.mark.parametrize("seed", SEEDS)
def test_free_flight_keeps_energy_and_momentum(seed: int) -> None:
    """After a push: kinetic energy and that of the springs, linear and angular momentum."""
    flight = TreeFlight(tree(seed, lossless=True), viscous=0.0)
    model, data = flight.model, flight.data
    flight.fly(np.concatenate([TORQUE[:3], np.zeros(3)]), 200)

    def kept() -> tuple[float, Array]:
        q, v = flight.configuration()
        pin.computeCentroidalMomentum(model, data, q, v)
        kinetic = pin.computeKineticEnergy(model, data, q, v)
        return kinetic + flight.spring_energy(), np.array(data.hg)

    (energy, momentum), stretched = kept(), 0.0
    assert np.abs(momentum[:3]).max() < 1e-10, "a torque pushes nothing away"
    assert np.linalg.norm(momentum[3:]) > 5.0
    for _ in range(10):
        flight.fly(np.zeros(6), 200)
        now, momentum_now = kept()
        assert now == pytest.approx(energy, rel=1e-8)
        np.testing.assert_allclose(momentum_now, momentum, rtol=0.0, atol=1e-9)
        stretched = max(stretched, flight.spring_energy())
    assert stretched > 1e-4 * energy, "springs must take their part"
