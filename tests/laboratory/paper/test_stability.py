"""The paper's proofs: (46) to (77), Lemma 1, reaching times, by independent code; the command."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from closed_loop import GAINS, H_BAR
from hypothesis import given
from hypothesis import strategies as st
from oracles import rho_space_inertia

from space_robot.analysis.errors import continuous_error, mean_acceleration
from space_robot.cli.main import cli
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.simulate import simulate
from space_robot.paper.lyapunov import (
    B,
    C,
    certify,
    largest_gamma,
    largest_tolerated_beta,
    paper_m,
    residual,
    shifted_gains,
    state_matrix,
    transfer_function,
)
from space_robot.paper.stability import (
    Check,
    StabilityStudy,
    arrival,
    contraction,
    error_derivative,
    lyapunov_state,
    off_mission_plan,
    ripple,
    study,
    time_delay_error,
)
from space_robot.paper.stability_figures import draw
from space_robot.paper.stability_report import report
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

PRINTED = sorted(set(zip(GAINS["tde_stc"]["k_1"], GAINS["tde_stc"]["k_2"], strict=True)))


@st.composite
def gains(draw: st.DrawFn, damped: bool = False) -> tuple[float, float]:
    """K_1 over four decades, ``4 K_2 / K_1^2`` from 0.04 to 0.96 (damped) or to 20."""
    k_1 = 10.0 ** draw(st.floats(-3.0, 1.0))
    return k_1, k_1**2 / 4.0 * draw(st.floats(0.04, 0.96 if damped else 20.0))


@given(gains(), st.floats(0.0, 100.0))
def test_transfer_function_is_that_of_the_state_space(
    pair: tuple[float, float], ratio: float
) -> None:
    """(72) and (74)."""
    omega = ratio * np.sqrt(pair[1])
    inverse = np.linalg.inv(1j * omega * np.eye(2) - state_matrix(*pair))
    assert transfer_function(*pair, np.array(omega)) == pytest.approx((C @ inverse @ B)[0, 0])


def feasible(k_1: float, k_2: float, beta: float, gamma: float) -> bool:
    """Whether Clarabel finds an M for (51), written for K_1 = 1 (time in units of 1 / K_1)."""
    kappa, b = k_2 / k_1**2, beta / k_1**2
    a, e = np.array([[-0.5, 0.5], [-kappa, 0.0]]), np.eye(2)
    import cvxpy as cp  # two seconds, which each test process would take to collect this file

    m, slack = cp.Variable((2, 2), symmetric=True), cp.Variable()
    # V and phi in units of beta: the corner is C^T C, the disturbance enters through b B
    corner = a.T @ m + m @ a + gamma / k_1 * m + C.T @ C
    block = cp.bmat([[corner, b * m @ B], [b * B.T @ m, -np.eye(1)]])
    constraints = [block << slack * np.eye(3), m >> 0, m << 1e4 * e]
    problem = cp.Problem(cp.Minimize(slack), constraints)
    problem.solve(solver=cp.CLARABEL)
    return bool(problem.status == "optimal" and slack.value <= 1e-7)


@pytest.mark.parametrize("pair", [*PRINTED, (0.1, 0.01), (3.0, 1.0)])
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_largest_gamma_is_that_of_a_semidefinite_program(
    pair: tuple[float, float], share: float
) -> None:
    beta = share * largest_tolerated_beta(*pair)
    largest = largest_gamma(*pair, beta)
    assert largest is not None
    low, high = 0.0, pair[0]
    while high - low > 1e-4 * largest:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if feasible(*pair, beta, middle) else (low, middle)
    assert largest == pytest.approx(low, rel=2e-3)


@given(gains(), st.floats(0.01, 0.99))
def test_certificate_solves_the_lmi(pair: tuple[float, float], share: float) -> None:
    """M > 0 with a residual not above zero; with 2 % more gamma the frequency condition fails."""
    limit = largest_tolerated_beta(*pair)
    certificate = certify(*pair, share * limit)
    assert certificate is not None
    assert certificate.gamma > 0.0
    assert certificate.m_eigenvalues[0] > 0.0
    assert certificate.residual <= 1e-14
    omega = np.sqrt(pair[1]) * np.linspace(0.0, 3.0, 20_001)
    a = state_matrix(*pair) + 0.51 * certificate.gamma * np.eye(2)
    if np.linalg.eigvals(a).real.max() < 0.0:
        shifted = shifted_gains(*pair, 1.02 * certificate.gamma)
        assert np.abs(transfer_function(*shifted, omega)).max() > 1.0 / certificate.beta


@given(gains(), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_paper_m_needs_a_k_1_of_two(pair: tuple[float, float], beta: float, gamma: float) -> None:
    """The corner of the Schur complement of (51) with (48) is ``-K_1/2 + gamma + 1``."""
    k_1, k_2 = pair
    m, a = paper_m(k_1, k_2), state_matrix(k_1, k_2)
    schur = a.T @ m + m @ a + gamma * m + beta**2 * C.T @ C + m @ B @ B.T @ m
    assert schur[1, 1] == pytest.approx(-k_1 / 2.0 + gamma + 1.0)
    if k_1 < 2.0:
        assert residual(m, k_1, k_2, beta, gamma) > 0.0


PERIOD = 0.01


def test_arrival_is_the_first_long_stay_below_the_threshold() -> None:
    s = np.ones((1000, 4))
    s[300:, 0] = 0.05  # stays
    s[200:250, 1] = 0.05  # half a second only
    s[400:600, 1] = -0.05  # two seconds, then pushed off again
    s[:, 2] = 0.0  # there from the start
    s[950:, 3] = 0.0  # too late to tell
    times = arrival(s, np.full(4, 0.1), PERIOD)
    np.testing.assert_allclose(times[:3], [3.0, 4.0, 0.0])
    assert np.isnan(times[3])


def test_ripple_leaves_out_the_rarest_ticks() -> None:
    s = np.full((10_000, 2), -1e-7)
    s[5] = 1.0
    np.testing.assert_allclose(ripple(s), 1e-7)


def test_psi_makes_the_paper_s_equations_true() -> None:
    """Both lines of (46) for an s that follows them: psi is eps less the law's integral."""
    k_1, k_2, period = 0.2, 3e-3, 1e-4
    time = period * np.arange(20_001)
    epsilon = 1e-3 * np.sin(time)
    s, integral, law = 1e-3, 0.0, []
    values = []
    for k in range(len(time)):
        values.append(s)
        law.append(integral)
        s += period * (epsilon[k] - k_1 * np.sqrt(abs(s)) * np.sign(s) - integral)  # (44)
        integral += period * k_2 * np.sign(values[-1])
    eta = lyapunov_state(np.array(values)[:, np.newaxis], np.array([k_1]), period)[:, 0]
    np.testing.assert_allclose(eta[:, 0] * np.abs(eta[:, 0]), values[:-1], atol=1e-15)
    np.testing.assert_allclose(eta[:, 1], (epsilon - law)[:-1], atol=1e-9)
    psi_rate = np.diff(eta[:, 1]) / period
    expected = -k_2 * np.sign(values[:-2]) + 1e-3 * np.cos(time[:-2])
    np.testing.assert_allclose(psi_rate, expected, atol=1e-6)


@pytest.mark.parametrize("robot", ["paper", "seven_joint"])
def test_flight_starts_with_the_same_error_on_every_axis(robot: str) -> None:
    flight = Flight(resolve(Scenario(robot=robot, duration=0.001, gains="tuned")))
    log = simulate(Flight(resolve(off_mission_plan(flight, 2e-3))))
    assert log.telemetry is not None
    np.testing.assert_allclose(log.telemetry[0, 3], 2e-3, rtol=1e-9)
    np.testing.assert_allclose(log.telemetry[0, 0], 3.0 * 2e-3, rtol=1e-9)  # s = lambda e


def desired(plan: Scenario, every: float) -> tuple[Flight, FlightLog]:
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
    flight, log = desired(Scenario(), every=0.0125)  # 40 samples of these make 20 s
    h_bar = np.array(H_BAR)
    found = contraction(flight.plant.robot, h_bar, log)
    assert found.norm.below_one.holds is False
    assert found.radius.below_one.holds is True
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


@pytest.mark.parametrize("law", ["tde_stc", "tde_tsmc", "tde_smc"])
@pytest.mark.parametrize("robot", ["paper", "seven_joint"])
def test_error_is_what_the_paper_defines(law: str, robot: str) -> None:
    """``h_bar eps = N - N_hat`` (65), N being the next tick's estimate, and ``eps = u - rhodd``."""
    plant = {"initial_quaternion": [0.9, 0.1, -0.3, 0.2], "base_torque_limit": 50.0}
    plan = Scenario(
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


def run(*arguments: str) -> str:
    """Standard output of the command."""
    environment = {"COLUMNS": "80"}
    result = CliRunner(env=environment).invoke(cli, ["stability", *arguments])
    assert result.exit_code == 0, result.output
    return result.stdout


def studied(**options: Any) -> StabilityStudy:
    plan = Scenario.model_validate({"duration": 0.1, **options})
    return study(plan, 1e-3, lambda flight, which: simulate(flight))


def test_the_free_m_of_printed_gains() -> None:
    """The rest of their numbers stands in docs/explanation/stability.md, which has a test."""
    options = ("--duration", "0.2", "--gains", "printed", "--json")
    twisting = json.loads(run(*options))["super_twisting"]
    checks = [check["holds"] for check in twisting["circle_criterion"]]
    assert checks == [False] * 9
    assert twisting["tolerated_beta"] == twisting["k_2"]
    free = twisting["lmi"]["assumed_beta_half_of_tolerated"]
    for k_2, solved in zip(twisting["k_2"], free, strict=True):
        assert solved["beta"] == pytest.approx(k_2 / 2)
        assert solved["residual"] <= 0.0 < solved["gamma"]


def test_other_laws_get_what_applies_to_them() -> None:
    for law in ("tde_smc", "tde_tsmc"):
        found = report(studied(controller=law))
        assert found["super_twisting"] is None
        assert len(found["time_delay_error"]["as_flown"]["beta"]) == 9
    assert "do not apply" in run("--controller", "tde_smc", "--duration", "0.1")


def test_seven_joints(tmp_path: Path) -> None:
    found = studied(robot="seven_joint")
    data = report(found)
    assert len(data["axes"]) == len(data["super_twisting"]["k_1"]) == 10
    names = [path.name for path in draw(found, tmp_path)]
    assert names == ["nyquist.png", "nyquist.svg", "lyapunov.png", "lyapunov.svg"]
    assert matplotlib.image.imread(tmp_path / names[0]).std() > 0.01


def test_report_of_infinite_numbers_is_json(tmp_path: Path) -> None:
    """K_1 = 0 has an infinite peak and no M: null, and the command still ends well."""
    path = tmp_path / "tde_stc.yaml"
    gains = {**GAINS["tde_stc"], "k_1": [0.0]}
    path.write_text(yaml.safe_dump({"controller_node": {"ros__parameters": {"tde_stc": gains}}}))
    found = studied(gains=str(path), duration=0.05)
    data = json.loads(json.dumps(report(found), allow_nan=False))["super_twisting"]
    assert data["circle_criterion"][0]["value"] is None
    assert data["circle_criterion"][0]["holds"] is False
    assert data["lmi"]["assumed_beta_half_of_tolerated"] == [None] * 9
    assert data["reaching"]["reaching_time_s_below_bound"][0]["holds"] is None
    assert len(draw(found, tmp_path / "figures")) == 4


@pytest.mark.parametrize(
    ("plan", "said"), [({"duration": 0.002}, "10 ticks"), ({"controller": "ctc_smc"}, "ctc_smc")]
)
def test_what_cannot_be_studied_is_refused_before_it_flies(plan: dict[str, Any], said: str) -> None:
    def never(flight: Flight, which: str) -> Any:
        if "controller" in plan:
            raise AssertionError(which)
        return simulate(flight)

    with pytest.raises(InputError, match=said):
        study(Scenario.model_validate(plan), 1e-3, never)


def test_a_check_of_unknown_numbers_is_open() -> None:
    assert Check(1.0, 2.0, applies=False).verdict == "not applicable"
    assert (Check(1.0, 2.0).verdict, Check(2.0, 2.0).verdict) == ("holds", "fails")
    assert Check(float("nan"), 2.0).verdict == Check(1.0, float("nan")).verdict == "open"
