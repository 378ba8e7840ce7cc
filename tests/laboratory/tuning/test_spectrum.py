"""Eigenvalues of H_S^-1 h_bar against SciPy, and what they say against flights."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from closed_loop import H_BAR
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.tuning.inertia import inertia_along, semi_floating_inertia
from space_robot.tuning.spectrum import Spectrum, eigenvalues, spectrum
from space_robot_msgs_py.errors import DivergedError


def some_inertia(rng: np.random.Generator, m: int) -> np.ndarray:
    """A positive definite matrix."""
    root = rng.normal(size=(m, m))
    return root @ root.T + 0.1 * np.eye(m)


@given(st.integers(0, 2**32 - 1), st.integers(1, 10))
@settings(max_examples=30, deadline=None)
def test_eigenvalues_are_scipys(seed: int, m: int) -> None:
    rng = np.random.default_rng(seed)
    inertia, h_bar = some_inertia(rng, m), rng.uniform(0.01, 100.0, m)
    expected = scipy.linalg.eigh(np.diag(h_bar), inertia, eigvals_only=True)
    np.testing.assert_allclose(eigenvalues(inertia[np.newaxis], h_bar)[0], expected, rtol=1e-8)
    found = spectrum(inertia[np.newaxis], h_bar)
    w = np.eye(m) - np.linalg.solve(inertia, np.diag(h_bar))
    assert found.radius == pytest.approx(np.max(np.abs(np.linalg.eigvals(w))), rel=1e-7)
    assert found.norm == pytest.approx(np.linalg.norm(w, 2))


@given(st.integers(0, 2**32 - 1), st.floats(0.05, 1.0), st.floats(0.5, 1.3), st.floats(0.2, 3.0))
@settings(max_examples=50, deadline=None)
def test_an_error_of_the_estimate_grows_as_the_formula_says(
    seed: int, weight: float, reported: float, given_torque: float
) -> None:
    """The recursion of (36) itself, as the controller runs it: force and acceleration apart."""
    rng = np.random.default_rng(seed)
    m = 3
    inertia, h_bar = some_inertia(rng, m), rng.uniform(0.05, 0.5, m)
    inverse = np.linalg.inv(inertia)

    def tick(memory: np.ndarray) -> np.ndarray:
        force, acceleration = memory[:m], memory[m:]
        command = force - h_bar * acceleration  # u and c are left out: they add, no more
        return np.concatenate(
            [
                force + weight * (reported * command - force),
                acceleration + weight * (given_torque * inverse @ command - acceleration),
            ]
        )

    matrix = np.column_stack([tick(column) for column in np.eye(2 * m)])
    expected = 1.0 + weight * (reported - 1.0 - given_torque * eigenvalues(inertia, h_bar))
    radius = max(*np.abs(expected), 1.0 - weight)  # what cancels in N_hat only fades
    assert np.max(np.abs(np.linalg.eigvals(matrix))) == pytest.approx(radius, rel=1e-6)


def test_limits_are_where_an_error_neither_grows_nor_fades() -> None:
    found = Spectrum(smallest=0.03, largest=1.2, norm=1.5)
    assert found.radius == pytest.approx(0.97)
    assert found.contracts
    assert found.is_sound
    assert 1.0 + found.margin - found.smallest == pytest.approx(1.0)
    assert 1.0 - found.largest_scale * found.largest == pytest.approx(-1.0)
    too_large = Spectrum(smallest=0.03, largest=2.1, norm=2.0)
    assert not too_large.contracts
    assert too_large.margin == pytest.approx(-0.1)
    assert Spectrum(0.03, 2.1, 2.0, weight=0.5).contracts


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.5))
@settings(max_examples=20, deadline=None)
def test_wrong_masses_move_eigenvalues_no_further_than_said(seed: int, share: float) -> None:
    rng = np.random.default_rng(seed)
    robot = Flight(resolve(FlightPlan())).robot
    factors = 1.0 + rng.uniform(-share, share, (2, robot.n + 1))
    wrong = replace(
        robot,
        mass=robot.mass * factors[0],
        inertia=robot.inertia * factors[1][:, np.newaxis, np.newaxis],
    )
    theta, h_bar = rng.uniform(-np.pi, np.pi, (1, robot.n)), np.array(H_BAR)
    nominal = eigenvalues(semi_floating_inertia(robot, theta), h_bar)
    found = eigenvalues(semi_floating_inertia(wrong, theta), h_bar)
    assert np.all(found <= nominal / (1.0 - share) * (1.0 + 1e-9))
    assert np.all(found >= nominal / (1.0 + share) * (1.0 - 1e-9))


def fly(controller: str = "tde_stc", **plant: float) -> float:
    """The largest error of any axis in case 1, with parameters of the plant."""
    parameters = {"plant": {name: [value] for name, value in plant.items()}}
    log = simulate(Flight(resolve(FlightPlan(controller=controller, parameters=parameters))))
    assert log.telemetry is not None
    return float(np.max(np.abs(log.telemetry[:, 3])))


def test_margin_of_table_iv() -> None:
    """Its size, by spec an eigenvalue of 0.0031 to 0.0079, and what it means in flight."""
    flight = Flight(resolve(FlightPlan()))
    every = eigenvalues(inertia_along(flight.robot, flight.mission_settings), np.array(H_BAR))
    assert every[:, 0].min() == pytest.approx(0.0031, abs=5e-5)
    assert every[:, 0].max() == pytest.approx(0.0079, abs=5e-5)


@pytest.mark.parametrize("controller", ["tde_smc", "tde_stc"])
def test_a_torque_reported_too_large_by_more_than_the_margin_diverges(controller: str) -> None:
    with pytest.raises(DivergedError):
        fly(controller, echo_scale=1.01)
    assert fly(controller, echo_scale=1.005) < 1e-3


def test_a_torque_not_given_as_commanded_does_no_harm_if_the_command_is_reported() -> None:
    assert fly(drive_scale=0.99) < 1e-6
    assert fly(drive_scale=1.5) < 1e-6


def test_a_torque_reported_too_small_costs_accuracy_but_does_not_diverge() -> None:
    assert 1e-4 < fly(echo_scale=0.99) < 1e-2
