"""The LMI (51) and the circle criterion against Clarabel, a frequency sweep, and (46) itself."""

from __future__ import annotations

import numpy as np
import pytest
from closed_loop import GAINS
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from space_robot.paper.stability.circle_criterion import (
    largest_tolerated_beta,
    peak_gain,
    transfer_function,
)
from space_robot.paper.stability.lyapunov import (
    B,
    C,
    Certificate,
    certify,
    largest_gamma,
    lyapunov_matrix,
    paper_m,
    residual,
    shifted_gains,
    state_matrix,
)

PRINTED = sorted(set(zip(GAINS["tde_stc"]["k_1"], GAINS["tde_stc"]["k_2"], strict=True)))


@st.composite
def gains(draw: st.DrawFn, damped: bool = False) -> tuple[float, float]:
    """K_1 over four decades, ``4 K_2 / K_1^2`` from 0.04 to 0.96 (damped) or to 20."""
    k_1 = 10.0 ** draw(st.floats(-3.0, 1.0))
    return k_1, k_1**2 / 4.0 * draw(st.floats(0.04, 0.96 if damped else 20.0))


@given(gains())
def test_peak_is_that_of_a_sweep(pair: tuple[float, float]) -> None:
    omega = np.sqrt(pair[1]) * np.concatenate([[0.0], np.geomspace(1e-2, 1e2, 20_001)])
    sweep = np.abs(transfer_function(*pair, omega)).max()
    assert sweep <= peak_gain(*pair) * (1.0 + 1e-12)
    assert sweep == pytest.approx(peak_gain(*pair), rel=1e-5)


@given(gains(), st.floats(0.0, 100.0))
def test_transfer_function_is_that_of_the_state_space(
    pair: tuple[float, float], ratio: float
) -> None:
    """(72) and (74)."""
    omega = ratio * np.sqrt(pair[1])
    inverse = np.linalg.inv(1j * omega * np.eye(2) - state_matrix(*pair))
    assert transfer_function(*pair, np.array(omega)) == pytest.approx((C @ inverse @ B)[0, 0])


def test_printed_77_is_wrong_in_its_second_case() -> None:
    """K_1 = 0.1, K_2 = 0.01: the right number, and the one that (77) gives."""
    k_1, k_2 = 0.1, 0.01
    right = 16.0 / (8.0 * k_2 * k_1**2 - k_1**4)
    printed = 16.0 / (k_1**4 + 8.0 * k_2 * k_1**2 - 2.0 * k_1**3)
    sweep = np.abs(transfer_function(k_1, k_2, np.linspace(0.0, 1.0, 200_001))).max() ** 2
    assert sweep == pytest.approx(right, rel=1e-8) == 22857.142857142857
    assert peak_gain(k_1, k_2) ** 2 == pytest.approx(right)
    assert printed == pytest.approx(-14545.454545454546)  # not even a square


@pytest.mark.parametrize("pair", [(0.0, 1.0), (1.0, 0.0), (0.0, 0.0)])
def test_a_gain_of_zero_tolerates_nothing(pair: tuple[float, float]) -> None:
    assert peak_gain(*pair) == np.inf
    assert largest_tolerated_beta(*pair) == 0.0
    assert certify(*pair, 1e-3) is None


@given(gains(), st.floats(0.0, 0.4))
def test_shifted_gains_are_those_of_the_shifted_transfer_function(
    pair: tuple[float, float], share: float
) -> None:
    """``G(s - gamma/2)``."""
    gamma, s = share * pair[0], 1j * np.sqrt(pair[1])
    k_1, k_2 = shifted_gains(*pair, gamma)
    shifted = s - gamma / 2.0
    expected = 2.0 * shifted**2 + pair[0] * shifted + pair[1]
    assert 2.0 * s**2 + k_1 * s + k_2 == pytest.approx(expected, rel=1e-9)


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


@given(gains(), st.floats(1.0, 100.0))
def test_no_certificate_beyond_the_tolerated_beta(pair: tuple[float, float], factor: float) -> None:
    assert certify(*pair, factor * largest_tolerated_beta(*pair)) is None


@given(gains(damped=True))
def test_tolerated_beta_of_damped_gains_is_k_2(pair: tuple[float, float]) -> None:
    """The paper's condition ``K_2 > beta``."""
    assert largest_tolerated_beta(*pair) == pair[1]


@given(gains(), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_paper_m_needs_a_k_1_of_two(pair: tuple[float, float], beta: float, gamma: float) -> None:
    """The corner of the Schur complement of (51) with (48) is ``-K_1/2 + gamma + 1``."""
    k_1, k_2 = pair
    m, a = paper_m(k_1, k_2), state_matrix(k_1, k_2)
    schur = a.T @ m + m @ a + gamma * m + beta**2 * C.T @ C + m @ B @ B.T @ m
    assert schur[1, 1] == pytest.approx(-k_1 / 2.0 + gamma + 1.0)
    if k_1 < 2.0:
        assert residual(m, k_1, k_2, beta, gamma) > 0.0


@pytest.mark.parametrize("pair", PRINTED)
def test_a_multiple_of_paper_m_is_a_solution(pair: tuple[float, float]) -> None:
    """So only its scale is at fault: for half the tolerated beta, and a gamma above zero."""
    k_1, k_2 = pair
    multiples = np.geomspace(0.01, 0.5, 200) * k_1
    worst = [residual(x * paper_m(k_1, k_2), k_1, k_2, 0.5 * k_2, 1e-4 * k_1) for x in multiples]
    assert min(worst) <= 0.0
    assert worst[-1] > 0.0


def test_riccati_equation_of_the_printed_gains_in_plain_units() -> None:
    for k_1, k_2 in PRINTED:
        beta, gamma = 0.5 * k_2, 0.5 * (largest_gamma(k_1, k_2, 0.5 * k_2) or np.nan)
        m, a = lyapunov_matrix(k_1, k_2, beta, gamma), state_matrix(k_1, k_2)
        left = a.T @ m + m @ a + gamma * m + beta**2 * C.T @ C + m @ B @ B.T @ m
        scale = np.outer([k_1, 1.0], [k_1, 1.0]) * beta**2 / k_1**2
        np.testing.assert_allclose(left / scale, np.zeros((2, 2)), atol=1e-9)


def certificate_of(k_1: float, k_2: float, share: float) -> Certificate:
    certificate = certify(k_1, k_2, share * largest_tolerated_beta(k_1, k_2))
    assert certificate is not None
    return certificate


@settings(max_examples=40)
@given(
    gains(),
    st.floats(0.05, 0.95),
    st.floats(-3.0, 3.0),
    st.floats(-1.0, 1.0),
    st.floats(0.0, 20.0),
    st.floats(0.0, 6.0),
)
def test_any_disturbance_within_beta_dies_out_within_56(
    pair: tuple[float, float],
    share: float,
    angle: float,
    push: float,
    frequency: float,
    phase: float,
) -> None:
    """(46) in the time of (50), ``dt = |eta_1| dtau``, smooth even where s crosses zero."""
    k_1, k_2 = pair
    certificate = certificate_of(k_1, k_2, share)
    a, start = state_matrix(k_1, k_2), np.array([np.cos(angle), k_1 * np.sin(angle)])
    initial = float(certificate.value(start))

    def slope(_: float, x: np.ndarray) -> np.ndarray:
        wave = np.sin(frequency * k_1 * x[2] + phase)
        epsilon_rate = certificate.beta * np.clip(push + wave, -1.0, 1.0)
        phi = np.abs(x[0]) * epsilon_rate
        return np.array([*(a @ x[:2] + [0.0, phi]), np.abs(x[0])])

    def dead(_: float, x: np.ndarray) -> float:
        return float(certificate.value(x[:2])) / initial - 1e-8

    dead.terminal = True  # type: ignore[attr-defined]
    end = 40.0 / certificate.gamma
    flown = solve_ivp(
        slope, (0.0, end), [*start, 0.0], events=dead, rtol=1e-7, atol=1e-10 * np.array([1, k_1, 1])
    )
    assert flown.status == 1, "V did not die out at all"
    assert flown.y[2, -1] <= certificate.reaching_time(initial)
    values = certificate.value(flown.y[:2].T)
    bound = certificate.bound(initial, flown.y[2])
    assert np.all(values <= bound + 1e-5 * initial)


def test_the_plain_equations_reach_within_56_too() -> None:
    """(46) with small steps, printed gains, epsdot always pushing s away."""
    for k_1, k_2 in PRINTED:
        certificate = certificate_of(k_1, k_2, 0.5)
        s, psi = 1e-3, 0.0
        initial = float(certificate.value(np.array([np.sqrt(s), psi])))
        limit = certificate.reaching_time(initial)
        step = limit / 20_000
        for _ in range(20_000):
            s, psi = (
                s + step * (-k_1 * np.sqrt(abs(s)) * np.sign(s) + psi),
                psi + step * (-k_2 + certificate.beta) * np.sign(s),
            )
        assert abs(s) < 1e-6
