"""Lemma 1 and the time-delay error against Pinocchio, the estimator's own numbers, and flights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml
from closed_loop import GAINS, H_BAR
from hypothesis import given, settings
from oracles import rho_space_inertia
from strategies import Case, cases

from space_robot.analysis.generalised_motion import continuous_error, mean_acceleration
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.paper.stability.lemma_1 import contraction
from space_robot.paper.stability.time_delay_error import error_derivative, time_delay_error
from space_robot.tuning.spectrum import contraction_matrix
from space_robot_msgs_py.bag.flight_log import FlightLog


def desired(plan: FlightPlan, every: float) -> tuple[Flight, FlightLog]:
    """A log of the desired motion, a row each ``every`` seconds."""
    flight = Flight(resolve(plan))
    step = round(every / flight.period)
    rows = flight.mission.chunk(0, flight.ticks + 1)
    log = FlightLog.allocate(len(rows.base[::step]), flight.robot.joint_names, flight.timebase)
    log.quaternion[:] = rows.base[::step, :4]
    log.reference_base[:] = rows.base[::step]
    log.omega_base[:] = rows.base[::step, 4:7]
    log.joint_positions[:] = rows.joints[::step, 0]
    log.joint_velocities[:] = rows.joints[::step, 1]
    return flight, log


def test_lemma_1_with_table_iv() -> None:
    """The printed h_bar does not meet the printed condition, but its spectral radius is below 1."""
    flight, log = desired(FlightPlan(), every=0.0125)  # 40 samples of these make 20 s
    h_bar = np.array(H_BAR)
    found = contraction(flight.plant.robot, h_bar, log)
    assert found.norm.min == pytest.approx(1.026, abs=1e-3)
    assert found.norm.max == pytest.approx(1.029, abs=1e-3)
    assert found.radius.min == pytest.approx(0.992, abs=1e-3)
    assert found.radius.max == pytest.approx(0.997, abs=1e-3)
    assert found.norm_below_one.holds is False
    assert found.radius_below_one.holds is True
    sampled = range(0, log.ticks, 40)
    w = [
        np.eye(9) - np.linalg.inv(rho_space_inertia(flight.robot, q, theta)) @ np.diag(h_bar)
        for q, theta in zip(log.quaternion[sampled], log.joint_positions[sampled], strict=True)
    ]
    norms = [np.linalg.norm(x, 2) for x in w]
    radii = [max(abs(np.linalg.eigvals(x))) for x in w]
    assert (found.norm.min, found.norm.max) == pytest.approx((min(norms), max(norms)))
    assert (found.radius.min, found.radius.max) == pytest.approx((min(radii), max(radii)))
    assert found.norm.max_at_s == sampled[int(np.argmax(norms))] * flight.period


def test_lemma_1_is_about_the_robot_that_flies() -> None:
    """With the payload of its case."""
    flight, log = desired(FlightPlan(case="4-2", duration=0.1), every=0.02)
    heavy = contraction(flight.plant.robot, np.array(H_BAR), log)
    assert heavy.radius.max > contraction(flight.robot, np.array(H_BAR), log).radius.max


@settings(max_examples=30)
@given(cases())
def test_radius_is_the_norm_weighted_by_the_inertia(case: Case) -> None:
    """``H_S^1/2 W H_S^-1/2`` is symmetric: why a radius below 1 is enough."""
    robot, rng = case.robot, case.rng
    quaternion = np.array([0.9, *rng.normal(size=3) * 0.2])
    inertia = rho_space_inertia(robot, quaternion / np.linalg.norm(quaternion), case.state.theta)
    values, vectors = np.linalg.eigh(inertia)
    root = vectors @ np.diag(np.sqrt(values)) @ vectors.T
    w = contraction_matrix(inertia, rng.uniform(0.1, 1.0, robot.n + 3) * values[0])
    weighted = root @ w @ np.linalg.inv(root)
    assert np.linalg.norm(weighted, 2) == pytest.approx(max(abs(np.linalg.eigvals(w))), rel=1e-6)


@pytest.mark.parametrize("law", ["tde_stc", "tde_tsmc", "tde_smc"])
@pytest.mark.parametrize("robot", ["paper", "seven_joint"])
def test_error_is_what_the_paper_defines(law: str, robot: str) -> None:
    """``h_bar eps = N - N_hat`` (65), N being the next tick's estimate, and ``eps = u - rhodd``."""
    plant = {"initial_quaternion": [0.9, 0.1, -0.3, 0.2], "base_torque_limit": 50.0}
    plan = FlightPlan(
        controller=law, case="2", robot=robot, duration=0.1, parameters={"plant": plant}
    )
    flight = Flight(resolve(plan))
    log, gains = simulate(flight), flight.controller.law.gain_values
    assert log.telemetry is not None
    error = time_delay_error(log, gains["h_bar"])
    assert np.abs(error).max() > 1e-3
    s, u, n_hat, _ = np.swapaxes(log.telemetry, 0, 1)
    change = np.diff(n_hat, axis=0)
    np.testing.assert_allclose(gains["h_bar"] * error, change, atol=1e-9 * np.abs(change).max())
    if np.abs(log.applied_torque[:, :3]).max() < 50.0:  # else u is not what acted
        wanted = u[:-1] - mean_acceleration(log, continuous_error(log))
        if law == "tde_smc":  # its switching term stands beside h_bar u
            wanted += gains["g"] * np.sign(s[:-1]) / gains["h_bar"]
        np.testing.assert_allclose(error, wanted, atol=1e-9 * np.abs(error).max())


def test_derivative_of_a_known_error() -> None:
    """A ramp with one jump; the row of the first tick, without an estimate, does not count."""
    period = 0.5
    ramp = 0.25 * period * np.arange(5000.0)
    error = np.column_stack([ramp, -2.0 * ramp])
    error[0] = 1e6
    error[3000:, 1] += 10.0
    found = error_derivative(error, period)
    np.testing.assert_allclose(found.beta, [0.25, 19.5])
    assert found.beta_at_s[1] == 3000 * period
    np.testing.assert_allclose(found.beta_99_9_percentile, [0.25, 0.5])
    np.testing.assert_allclose(found.max_error, np.abs(error[1:]).max(axis=0))


def test_beta_grows_with_the_gains_it_is_to_be_compared_with(tmp_path: Path) -> None:
    """Without friction it is the loop's own: without K_1 and K_2 a tenth is left of it."""
    beta = []
    for factor in (1.0, 0.0):
        gains = dict(GAINS["tde_stc"])
        for name in ("k_1", "k_2"):
            gains[name] = [factor * value for value in gains[name]]
        path = tmp_path / "tde_stc.yaml"
        path.write_text(
            yaml.safe_dump({"controller_node": {"ros__parameters": {"tde_stc": gains}}})
        )
        plan = FlightPlan(gains=str(path), friction=False, duration=1.0)
        error = time_delay_error(simulate(Flight(resolve(plan))), np.array(H_BAR))
        beta.append(error_derivative(error, 5e-4).beta)
    assert np.all(beta[1] < 0.2 * beta[0])
    assert np.all(beta[0] > gains["k_2"])
