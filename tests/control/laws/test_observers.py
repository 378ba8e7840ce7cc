"""Laws that observe disturbances: poles of their observers, and what they have in common."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from closed_loop import H_BAR, Loop
from law_equations import random_gains
from numpy.typing import NDArray

from space_robot_control.controller.controller import Controller
from space_robot_control.laws import ControlLaw, LawGains, Signals, find_law, per_axis
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import RobotState

Array = NDArray[np.float64]

PERIOD = 5e-4
POLES = np.geomspace(1.0, 2000.0, 7)
"""omega_o of the axes, rad/s."""


# The extended state observer


class Axes:
    """Axes ``rhodd = d + F / J`` under ``adrc``, each with its own omega_o; d is constant."""

    def __init__(self, rng: np.random.Generator, push: float = 1.0) -> None:
        m = len(POLES)
        self.inertia, self._rng, self._push = rng.uniform(0.1, 10.0, m), rng, push
        gains = {"inertia": self.inertia, "omega_c": np.full(m, 3.0), "omega_o": POLES}
        self.law = find_law("adrc")(gains, PERIOD)
        self.state = rng.normal(size=(3, m))
        """rho, its rate and d."""
        self._force = np.zeros(m)
        self.observe()

    def observe(self) -> Array:
        """Errors of z_1, z_2 and z_3 after the law has seen this tick, (3, m)."""
        signals = Signals.view(Signals.block(len(POLES) - 3))
        signals.rho[:], signals.rho_rate[:] = self.state[:2]
        signals.error[:], signals.error_rate[:] = -self.state[:2]
        signals.applied_force[:] = self._force
        self.law.force(signals)
        memory = self.law.memory
        errors: Array = self.state - [memory.z_1, memory.z_2, memory.z_3]
        return errors

    def step(self) -> Array:
        """The same a tick later, after a force of any size has acted."""
        self._force = self._push * self._rng.normal(size=len(POLES))
        rho, rate, d = self.state
        acceleration = d + self._force / self.inertia
        rho = rho + PERIOD * rate + 0.5 * PERIOD**2 * acceleration
        self.state = np.array([rho, rate + PERIOD * acceleration, d])
        return self.observe()

    def mislead(self, error: Array) -> None:
        """Give the observer an error of z_1, z_2, z_3 (3, m)."""
        memory = self.law.memory
        memory.z_1[:], memory.z_2[:], memory.z_3[:] = self.state - error


UNITS = np.array([1.0, PERIOD, PERIOD**2])
"""Of position, rate and disturbance, for which the observer's matrix has entries of like size."""


def error_matrices(axes: Axes) -> Array:
    """(m, 3, 3) matrix of the observer's error from one tick to the next, in `UNITS`."""
    columns = []
    for k in range(3):
        error = np.zeros((3, len(POLES)))
        error[k] = 1.0 / UNITS[k]
        axes.mislead(error)
        columns.append(axes.step() * UNITS[:, None])
    return np.array(columns).transpose(2, 1, 0)


@pytest.mark.parametrize("seed", range(5))
def test_all_three_poles_of_the_observer_are_where_its_gain_says(seed: int) -> None:
    """``beta = 1 / (1 + omega_o T)``: the characteristic polynomial is ``(z - beta)^3``, and by
    Cayley and Hamilton ``(M - beta E)^3 = 0``; a motion of the axis and a force make no error."""
    assert "poles are at 1/(1 + omega_o T)" in find_law("adrc").gain_descriptions()["omega_o"]
    assert "pole is at 1/(1 + g T)" in find_law("dob").gain_descriptions()["bandwidth"]
    axes = Axes(np.random.default_rng(seed), push=0.1)
    for matrix, beta in zip(error_matrices(axes), 1.0 / (1.0 + POLES * PERIOD), strict=True):
        polynomial = np.poly(matrix)
        np.testing.assert_allclose(polynomial, np.poly([beta] * 3), rtol=0.0, atol=1e-9)
        cubed = np.linalg.matrix_power(matrix - beta * np.eye(3), 3)
        np.testing.assert_allclose(cubed, 0.0, atol=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_an_error_of_the_estimate_decays_with_these_poles(seed: int) -> None:
    """A triple pole: ``M^k = beta^k (E + k N + k (k - 1) / 2 N^2)`` with N nilpotent, whatever the
    axis does meanwhile."""
    rng = np.random.default_rng(seed)
    axes = Axes(rng, push=0.1)
    matrices, betas = error_matrices(axes), 1.0 / (1.0 + POLES[:, None, None] * PERIOD)
    n = matrices / betas - np.eye(3)
    first = rng.normal(size=(3, len(POLES)))
    axes.mislead(first / UNITS[:, None])
    for k in range(1, 201):
        error = axes.step() * UNITS[:, None]
        power = np.eye(3) + k * n + 0.5 * k * (k - 1) * (n @ n)
        wanted = betas[:, :, 0] ** k * np.einsum("aij,ja->ai", power, first)
        np.testing.assert_allclose(error, wanted.T, rtol=0.0, atol=1e-7)
    assert (np.abs(error[:, POLES > 500.0]) < 1e-6).all()


# Time-delay estimation under other names


class PdGains(LawGains):
    """Gains of the law below."""

    h_bar: Array = per_axis("inertia", "kg m2")
    k_p: Array = per_axis("K_P", "1/s2")
    k_d: Array = per_axis("K_D", "1/s")


class TimeDelayPd(ControlLaw):
    """PD control on the time-delay estimate, (37)."""

    name = "tde_pd"
    gains_type = PdGains

    def force(self, signals: Signals) -> Array:
        """``h_bar u + N_hat``."""
        u, x, gains = self.memory.u, signals, self.gains
        u[:] = x.acceleration_desired + gains.k_d * x.error_rate + gains.k_p * x.error
        return np.asarray(gains.h_bar * u + x.n_hat)


@pytest.fixture(scope="module")
def seen(paper_robot: Robot) -> list[tuple[RobotState, Any]]:
    """States and references of a flight in which the base turns, too."""
    gains = random_gains(find_law("pd"), 9, seed=1)
    loop = Loop(
        paper_robot, find_law("pd")(gains, PERIOD), initial_quaternion=[0.9, 0.3, -0.3, 0.1]
    )
    rows = []
    for _ in range(300):
        loop.fly(1)
        tick = loop.plant.tick
        if not loop.references.covers(tick):
            loop.references.add(loop.mission.chunk(tick, 100))
        rows.append((loop.plant.state.copy(), loop.references.at(tick).copy()))
    return rows


def answers(
    robot: Robot, law: ControlLaw, seen: list[tuple[RobotState, Any]], corner_hz: float = 0.0
) -> Iterator[Array]:
    """Forces of a controller that is shown states one after the other."""
    controller = Controller(robot, law, PERIOD, corner_hz)
    for state, reference in seen:
        controller.update(state, reference)
        yield controller.block[0].force.copy()


PD: dict[str, Array] = {"k_p": np.linspace(10.0, 30.0, 9), "k_d": np.linspace(5.0, 12.0, 9)}


@pytest.mark.parametrize("bandwidth", [20.0, 200.0, 5000.0])
def test_the_disturbance_observer_is_the_time_delay_estimate_behind_a_low_pass(
    paper_robot: Robot, seen: list[tuple[RobotState, Any]], bandwidth: float
) -> None:
    """With backward differences, of one weight ``w = g T / (1 + g T)``: the corner with
    ``1 - exp(-2 pi f T) = w`` is ``f = ln(1 + g T) / (2 pi T)``."""
    inertia = np.array(H_BAR)
    dob = find_law("dob")({"inertia": inertia, "bandwidth": np.full(9, bandwidth), **PD}, PERIOD)
    tde = TimeDelayPd({"h_bar": inertia, **PD}, PERIOD)
    corner_hz = np.log1p(bandwidth * PERIOD) / (2.0 * np.pi * PERIOD)
    one = np.array(list(answers(paper_robot, dob, seen)))
    other = np.array(list(answers(paper_robot, tde, seen, corner_hz)))
    np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-10 * np.abs(other).max())


@pytest.mark.parametrize("corner_hz", [0.0, 20.0])
def test_incremental_inversion_is_the_estimate_with_the_nominal_inertia(
    paper_robot: Robot, seen: list[tuple[RobotState, Any]], corner_hz: float
) -> None:
    """PD control with ``h_bar: nominal``, also as a law in Python."""
    indi = find_law("indi")(PD, PERIOD)
    tde = TimeDelayPd({"h_bar": np.zeros(9), **PD}, PERIOD)
    one = np.array(list(answers(paper_robot, indi, seen, corner_hz)))
    other = np.array(list(answers(paper_robot, tde, seen, corner_hz)))
    np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-12 * np.abs(other).max())
