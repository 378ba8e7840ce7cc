"""The attitude filter against Farrenkopf's formula, Riccati's equation and true errors."""

from __future__ import annotations

import numpy as np
import pytest
from attitude_sensors import (
    Array,
    Case,
    Measured,
    attitude_error,
    exponential,
    filtered,
    measure,
    product,
    turned_by,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import block_diag, expm, solve_discrete_are
from scipy.stats import chi2

from space_robot_control.controller.navigation.attitude_filter import MOST_REJECTED

REALITY = Case(across=5e-5, about=5e-5, arw=1e-6, rrw=1e-9, bias=1e-6, period=0.02, interval=5)
"""Its formula's values are 4.0139e-6 and 4.0010e-6 rad."""


def farrenkopf(sigma_n: float, sigma_v: float, sigma_u: float, dt: float) -> tuple[float, float]:
    """Standard deviation of one axis before and after an update in steady state."""
    s_v, s_u = sigma_v * dt**0.5 / sigma_n, sigma_u * dt**1.5 / sigma_n
    g = np.sqrt(1.0 + s_v**2 / 4.0 + s_u**2 / 48.0)
    z = g + s_u / 4.0 + 0.5 * np.sqrt(2.0 * g * s_u + s_v**2 + s_u**2 / 3.0)
    return sigma_n * np.sqrt(z**2 - 1.0), sigma_n * np.sqrt(1.0 - z**-2)


def riccati(case: Case, omega: Array) -> Array:
    """(6, 6) covariance before an update, in steady state, of a body that turns at ``omega``."""
    x, y, z = omega
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    continuous = np.zeros((6, 6))
    continuous[:3, :3], continuous[:3, 3:] = -skew, -np.eye(3)
    density = np.diag([case.arw**2] * 3 + [case.rrw**2] * 3)
    dt = case.period * case.interval
    # Van Loan 1978
    both = expm(np.block([[-continuous, density], [np.zeros((6, 6)), continuous.T]]) * dt)
    transition = both[6:, 6:].T
    noise = transition @ both[:6, 6:]
    of_tracker = np.diag([case.across**2] * 2 + [case.about**2])
    scale = np.diag([1e5] * 3 + [1e8] * 3)  # rad and rad/s differ by far
    inverse = np.linalg.inv(scale)
    found = solve_discrete_are(
        (scale @ transition @ inverse).T, np.eye(6, 3), scale @ noise @ scale,
        scale[:3, :3] @ of_tracker @ scale[:3, :3],
    )  # fmt: skip
    covariance: Array = inverse @ found @ inverse
    return covariance


def still(case: Case, ticks: int, rng: np.random.Generator, bias: object = None) -> Measured:
    attitudes = np.tile([1.0, 0.0, 0.0, 0.0], (ticks, 1))
    return measure(case, attitudes, np.zeros((ticks, 3)), rng, bias)


def test_the_formula_is_that_of_the_specification() -> None:
    before, after = farrenkopf(5e-5, 1e-6, 1e-9, 0.1)
    assert before == pytest.approx(4.0139e-6, abs=5e-11)
    assert after == pytest.approx(4.0010e-6, abs=5e-11)


def test_the_covariance_settles_at_farrenkopfs() -> None:
    """On a body at rest the discrete propagation is exact."""
    ticks = 200_001  # 20000 s, twenty times the bias's time constant
    case = REALITY._replace(period=0.1, interval=1)
    p = filtered(case, still(case, ticks, np.random.default_rng(1))).covariance[-1]
    before, after = farrenkopf(5e-5, 1e-6, 1e-9, 0.1)
    assert np.sqrt(p[0, 0]) == pytest.approx(after, rel=1e-7)
    later = p[0, 0] - 0.2 * p[0, 3] + 0.01 * p[3, 3] + 1e-12 * 0.1 + 1e-18 * 0.1**3 / 3.0
    assert np.sqrt(later) == pytest.approx(before, rel=1e-7)


def test_true_errors_in_steady_state_are_farrenkopfs() -> None:
    """Root mean square over 40 seeds, three axes and 400 s, just after updates."""
    before, after = farrenkopf(5e-5, 1e-6, 1e-9, 0.1)
    steady = riccati(REALITY, np.zeros(3))
    case = REALITY._replace(bias=float(np.sqrt(steady[3, 3])))
    ticks, burnt = 25_000, 5_000
    squares = {"before": [], "after": []}  # type: dict[str, list[Array]]
    for seed in range(40):
        found = filtered(case, still(case, ticks, np.random.default_rng(seed)))
        error = attitude_error(found.delayed, np.array([1.0, 0.0, 0.0, 0.0]))
        squares["after"].append(error[burnt :: case.interval] ** 2)
        squares["before"].append(error[burnt + case.interval - 1 :: case.interval] ** 2)
    assert np.sqrt(np.mean(squares["after"])) == pytest.approx(after, rel=0.05)
    assert np.sqrt(np.mean(squares["before"])) == pytest.approx(before, rel=0.05)


@pytest.mark.parametrize("degrees", [0.0, 3.0])
def test_the_covariance_solves_riccatis_equation(degrees: float) -> None:
    """With a boresight, and turning, so that attitude and axes mix."""
    case = Case(across=1e-5, about=8e-5, arw=1e-6, rrw=1e-7, bias=1e-6, period=0.02, delay=7)
    omega = np.radians(degrees) * np.array([1.0, -0.5, 0.3])
    ticks = 20_000
    attitudes = np.cumprod(np.ones(ticks))[:, None] * exponential(
        np.arange(ticks)[:, None] * case.period * omega
    )
    rates = np.tile(omega, (ticks, 1))
    found = filtered(case, measure(case, attitudes, rates, np.random.default_rng(2)))
    # the last tick before an update, and one more tick by hand
    last = (ticks - 1 - case.delay) // case.interval * case.interval + case.delay
    x, y, z = omega
    skew = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    joint = np.zeros((6, 6))
    joint[:3, :3], joint[:3, 3:] = -skew, -np.eye(3)
    transition = expm(joint * case.period)
    noise = block_diag(np.eye(3) * case.arw**2 * case.period, np.eye(3) * case.rrw**2 * case.period)
    predicted = transition @ found.covariance[last - 1] @ transition.T + noise
    expected = riccati(case, omega)
    scale = np.sqrt(np.diag(expected))
    np.testing.assert_allclose(
        predicted / np.outer(scale, scale), expected / np.outer(scale, scale), atol=2e-3
    )


def nees(case: Case, attitudes: Array, rates: Array, seeds: int, at: list[int]) -> Array:
    """(seeds, at) normalised squares of the six errors at k - D."""
    result = np.empty((seeds, len(at)))
    for seed in range(seeds):
        measured = measure(case, attitudes, rates, np.random.default_rng(1000 + seed))
        found = filtered(case, measured)
        for column, tick in enumerate(at):
            then = tick - case.delay
            error = np.r_[
                attitude_error(found.delayed[tick], attitudes[then]),
                measured.bias[then] - found.bias[tick],
            ]
            result[seed, column] = error @ np.linalg.solve(found.covariance[tick], error)
    return result


@pytest.mark.parametrize("delay", [0, 13])
def test_the_filter_is_consistent(delay: int) -> None:
    """NEES of 60 seeds within the 95 % bounds of chi square: turning, late, with a bias.

    At eight moments, of which one may be beyond; and all together.
    """
    case = Case(
        across=1e-5, about=6e-5, arw=1e-6, rrw=2e-8, bias=2e-5, period=0.01, interval=10,
        delay=delay,
    )  # fmt: skip
    ticks, seeds = 10_000, 60

    def rate(t: float) -> Array:
        return np.radians(3.0) * np.array([np.cos(0.3 * t), 0.5, np.sin(0.2 * t)])

    attitudes = turned_by(rate, ticks, case.period)
    rates = np.array([rate(case.period * k) for k in range(ticks)])
    at = [50, 107, 309, 1003, 2501, 4999, 7504, 9999]
    found = nees(case, attitudes, rates, seeds, at)
    low, high = chi2.ppf([0.025, 0.975], 6 * seeds) / seeds
    inside = (found.mean(0) > low) & (found.mean(0) < high)
    assert inside.sum() >= len(at) - 1, found.mean(0)
    low, high = chi2.ppf([0.025, 0.975], 6 * seeds * 4) / (seeds * 4)
    assert low < found[:, ::2].mean() < high


def test_the_present_attitude_is_as_good_as_it_can_be() -> None:
    """Its error: that of k - D, the gyro's noise since, and the bias's since; over 40 seeds.

    A filter that took late measurements for present ones would be wrong by the whole turn.
    """
    case = Case(arw=1e-5, rrw=1e-8, bias=1e-5, period=0.01, interval=10, delay=25)
    omega = np.radians(10.0) * np.array([0.6, 0.0, 0.8])
    ticks = 4000
    attitudes = exponential(np.arange(ticks)[:, None] * case.period * omega)
    rates = np.tile(omega, (ticks, 1))
    squares, expected = [], []
    for seed in range(40):
        found = filtered(case, measure(case, attitudes, rates, np.random.default_rng(seed)))
        error = attitude_error(found.present, attitudes)[1500:]
        squares.append((error**2).mean())
        expected.append(np.trace(found.covariance[2000:2010, :3, :3].mean(0)) / 3.0)
    since = case.arw**2 * case.delay * case.period
    assert np.mean(squares) == pytest.approx(np.mean(expected) + since, rel=0.1)
    assert np.sqrt(np.mean(squares)) < 1e-3 * np.linalg.norm(omega) * case.delay * case.period * 2


def test_a_large_slew_is_followed() -> None:
    """Through one and a half turns at up to 20 degrees a second, a quarter of a second late."""
    case = Case(across=1e-5, about=8e-5, arw=1e-6, period=0.01, interval=10, delay=25)

    def rate(t: float) -> Array:
        return np.radians(20.0) * np.sin(np.pi * t / 60.0) ** 2 * np.array([0.36, 0.48, 0.8])

    ticks = 6000
    attitudes = turned_by(rate, ticks, case.period)
    rates = np.array([rate(case.period * k) for k in range(ticks)])
    found = filtered(case, measure(case, attitudes, rates, np.random.default_rng(3)))
    error = attitude_error(found.present, attitudes)[100:]
    assert np.abs(error).max() < 2e-4
    assert np.sqrt((error[-1000:] ** 2).mean()) < 2e-5


# Signs, the same twice, outliers


def test_the_sign_of_the_quaternion_does_not_matter() -> None:
    """Bit for bit, in whichever ticks it changes."""
    case = Case(period=0.01, interval=10, delay=5)
    rng = np.random.default_rng(4)
    measured = still(case, 500, rng)
    signs = np.where(rng.random((500, 1)) < 0.5, -1.0, 1.0)
    plain = filtered(case, measured)
    other = filtered(case, measured._replace(quaternions=measured.quaternions * signs))
    assert abs(np.diff(signs[::10], axis=0)).any()
    np.testing.assert_array_equal(other.covariance, plain.covariance)
    same = np.sign((other.present * plain.present).sum(1, keepdims=True))
    np.testing.assert_array_equal(other.present * same, plain.present)


def test_a_measurement_that_is_held_counts_once() -> None:
    case = Case(period=0.01, interval=10)
    filter = case.filter()
    filtered(case, still(case, 1001, np.random.default_rng(5)), filter)
    assert filter.updates == 99  # of 100 after the first; one of them began the filter


def test_a_wrong_measurement_changes_nothing() -> None:
    """But for the ones that the tracker did not give in its place."""
    case = Case(period=0.01, interval=10, delay=3)
    measured = still(case, 2000, np.random.default_rng(6))
    hit, blind = measured.quaternions.copy(), measured.quaternions.copy()
    hit[1003:1013] = product(hit[1003], exponential(np.array([0.05, -0.02, 0.0])))
    blind[1003:1013] = blind[1002]
    filter = case.filter()
    found = filtered(case, measured._replace(quaternions=hit), filter)
    expected = filtered(case, measured._replace(quaternions=blind))
    assert filter.rejected == 1
    np.testing.assert_array_equal(found.present, expected.present)
    np.testing.assert_array_equal(found.covariance, expected.covariance)


def test_a_filter_that_is_wrong_begins_anew() -> None:
    """Here after a jump of the attitude of which the gyro knows nothing."""
    case = Case(period=0.01, interval=10)
    measured = still(case, 2000, np.random.default_rng(7))
    jump = exponential(np.array([0.3, 0.0, 0.0]))
    measured.quaternions[1000:] = product(jump, measured.quaternions[1000:])
    filter = case.filter()
    found = filtered(case, measured, filter)
    assert filter.rejected == MOST_REJECTED
    error = np.linalg.norm(attitude_error(found.present, jump), axis=1)
    assert (error[1000 : 1000 + 10 * (MOST_REJECTED - 1)] > 0.2).all()
    assert (error[1000 + 10 * MOST_REJECTED :] < 5e-4).all()


# Properties


@settings(max_examples=60)
@given(
    st.integers(0, 2**32 - 1), st.sampled_from([1e-9, 1e-5, 1e-2]),
    st.sampled_from([0.0, 1.0, 1e3, 1e25]), st.integers(0, 60),
)  # fmt: skip
def test_attitude_stays_unit_and_covariance_positive_definite(
    seed: int, sigma: float, fastest: float, delay: int
) -> None:
    """Whatever the numbers that arrive, so long as they are finite."""
    rng = np.random.default_rng(seed)
    case = Case(
        across=sigma, about=sigma * 10.0 ** rng.uniform(0, 2), arw=10.0 ** rng.uniform(-9, -3),
        rrw=10.0 ** rng.uniform(-12, -4), bias=10.0 ** rng.uniform(-8, -2), period=5e-4,
        delay=delay,
    )  # fmt: skip
    quaternions = rng.normal(size=(300, 4))
    quaternions /= np.linalg.norm(quaternions, axis=1)[:, None]
    gyro = fastest * rng.normal(size=(300, 3))
    found = filtered(case, Measured(quaternions, gyro, gyro))
    for attitudes in (found.delayed, found.present):
        np.testing.assert_allclose(np.linalg.norm(attitudes, axis=1), 1.0, atol=1e-14)
    np.testing.assert_array_equal(found.covariance, np.swapaxes(found.covariance, 1, 2))
    deviation = np.sqrt(np.einsum("kii->ki", found.covariance))
    correlation = found.covariance / deviation[:, :, None] / deviation[:, None, :]
    assert np.linalg.eigvalsh(correlation).min() > -1e-9


def test_numbers_stay_sound_over_hours() -> None:
    """A million ticks, turning; the last errors are what the covariance says."""
    case = Case(
        across=1e-5, about=8e-5, arw=3e-7, rrw=1e-9, bias=1e-6, period=5e-3, interval=20, delay=20
    )
    omega = np.array([0.01, -0.02, 0.005])
    filter, worst = case.filter(), 0.0
    rng, bias = np.random.default_rng(8), np.zeros(3)
    for block in range(10):
        ticks = np.arange(100_000 * block, 100_000 * (block + 1))
        attitudes = exponential(ticks[:, None] * case.period * omega)
        measured = measure(case, attitudes, np.tile(omega, (len(ticks), 1)), rng, bias)
        bias = measured.bias[-1]
        found = filtered(case, measured, filter)
        error = attitude_error(found.present, attitudes)[50_000:]
        worst = max(worst, np.abs(error).max())
    np.testing.assert_allclose(np.linalg.norm(found.present, axis=1), 1.0, atol=1e-15)
    np.testing.assert_array_equal(filter.covariance, filter.covariance.T)
    assert np.linalg.eigvalsh(filter.covariance).min() > 0.0
    assert worst < 2e-5
