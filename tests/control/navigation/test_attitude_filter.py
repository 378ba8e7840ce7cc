"""The attitude filter against Riccati's equation and true errors."""

from __future__ import annotations

import re

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
    riccati,
    turned_by,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from paths import ROOT
from scipy.stats import chi2

from space_robot_control.navigation.attitude_filter import (
    MOST_REJECTED,
    propagate_covariance,
    update,
)
from space_robot_control.navigation.navigation import Navigation


def still(case: Case, ticks: int, rng: np.random.Generator, bias: object = None) -> Measured:
    attitudes = np.tile([1.0, 0.0, 0.0, 0.0], (ticks, 1))
    return measure(case, attitudes, np.zeros((ticks, 3)), rng, bias)


@pytest.mark.parametrize("degrees", [0.0, 3.0])
def test_the_covariance_settles_where_riccati_says(degrees: float) -> None:
    """Its solution stays over a measurement and the ticks to the next; on a body at rest exactly.

    With a boresight, and turning, so that attitude and axes mix.
    """
    case = Case(period=0.02, interval=5)
    if degrees:
        case = case._replace(across=1e-5, about=8e-5, rrw=1e-7)
    omega = np.radians(degrees) * np.array([1.0, -0.5, 0.3])
    steady, filter = riccati(case, omega), case.filter()
    filter.quaternion[:], filter.covariance[:] = [0.5, -0.5, 0.5, 0.5], steady
    assert update(filter, filter.quaternion, True)
    for _ in range(case.interval):
        filter.scratch.rotation[:] = omega * case.period
        propagate_covariance(filter, case.period)
    sigma = np.sqrt(np.diag(steady))
    scale, tolerance = np.outer(sigma, sigma), 1e-3 if degrees else 1e-10
    np.testing.assert_allclose(filter.covariance / scale, steady / scale, atol=tolerance)


@pytest.mark.parametrize("delay", [0, 13])
def test_the_filter_is_consistent(delay: int) -> None:
    """NEES of 60 seeds within the 95 % bounds of chi square: turning, late, with a bias.

    At eight moments, of which one may be beyond; and all together.
    """
    case = Case(1e-5, 6e-5, 1e-6, 2e-8, 2e-5, period=0.01, interval=10, delay=delay)
    ticks, seeds = 5_000, 60

    def rate(t: float) -> Array:
        return np.radians(3.0) * np.array([np.cos(0.3 * t), 0.5, np.sin(0.2 * t)])

    attitudes = turned_by(rate, ticks, case.period)
    rates = np.array([rate(case.period * k) for k in range(ticks)])
    at = [50, 107, 309, 1003, 1499, 2501, 3504, 4999]
    nees = np.empty((seeds, len(at)))
    for seed in range(seeds):
        measured = measure(case, attitudes, rates, np.random.default_rng(1000 + seed))
        found = filtered(case, measured)
        for column, tick in enumerate(at):
            of_attitude = attitude_error(found.delayed[tick], attitudes[tick - delay])
            error = np.r_[of_attitude, measured.bias[tick - delay] - found.bias[tick]]
            nees[seed, column] = error @ np.linalg.solve(found.covariance[tick], error)
    low, high = chi2.ppf([0.025, 0.975], 6 * seeds) / seeds
    inside = (nees.mean(0) > low) & (nees.mean(0) < high)
    assert inside.sum() >= len(at) - 1, nees.mean(0)
    low, high = chi2.ppf([0.025, 0.975], 6 * seeds * 4) / (seeds * 4)
    assert low < nees[:, ::2].mean() < high


# A single step


def random_covariance(rng: np.random.Generator, sigmas: Array) -> Array:
    root = rng.normal(size=(6, 6)) * sigmas[:, np.newaxis]
    covariance: Array = root @ root.T
    return covariance


@given(st.integers(0, 2**32 - 1), st.floats(0.5, 20.0), st.sampled_from([0.9, 0.999, 1.001, 1.1]))
@settings(max_examples=60)
def test_an_update_is_kalmans_within_the_gate_and_none_beyond(
    seed: int, gate: float, share: float
) -> None:
    """The gate is in standard deviations of the innovation, whatever its direction."""
    rng = np.random.default_rng(seed)
    across, about = 10.0 ** rng.uniform(-6.0, -5.0, 2)
    settings = Case(across=across, about=about).settings.model_copy(update={"gate": gate})
    filter = Navigation.build(1, settings, 0.01).attitude
    sigmas = np.repeat([1e-5, 1e-7], 3)
    p = random_covariance(rng, sigmas)
    filter.covariance[:], filter.bias[:] = p, 1e-6 * rng.normal(size=3)
    filter.quaternion[:] = exponential(rng.normal(size=3))
    truth, bias = filter.quaternion.copy(), filter.bias.copy()
    s = p[:3, :3] + filter.noise
    direction = rng.normal(size=3)
    innovation = share * gate * np.linalg.cholesky(s) @ (direction / np.linalg.norm(direction))
    accepted = update(filter, product(truth, exponential(innovation)), True)
    assert accepted == (share < 1.0)
    scale = np.outer(sigmas, sigmas)
    if not accepted:
        np.testing.assert_array_equal(filter.covariance, p)
        np.testing.assert_array_equal(np.r_[filter.quaternion, filter.bias], np.r_[truth, bias])
        return
    gain = np.linalg.solve(s, p[:3]).T
    after = p - gain @ s @ gain.T
    np.testing.assert_allclose(filter.covariance / scale, after / scale, atol=1e-9)
    moved = gain @ innovation
    np.testing.assert_allclose(filter.bias - bias, moved[3:], rtol=1e-6, atol=1e-14)
    found = attitude_error(truth, filter.quaternion)
    np.testing.assert_allclose(found, moved[:3], rtol=1e-6, atol=1e-12)


# What the gyro does that the filter does not know


@pytest.mark.parametrize("share", [0.0, 0.25, 1.0])
def test_a_jump_of_the_rate_costs_up_to_half_of_it_times_the_tick(share: float) -> None:
    """``(s - 1/2) jump h``, at a share s of the tick, until the tracker measures again."""
    case, jump, when = Case(period=5e-4, interval=400), np.array([0.02, -0.03, 0.01]), 200
    ticks = np.arange(350)
    since = np.maximum(0.0, ticks - when - share)[:, np.newaxis]
    truth = exponential(since * case.period * jump)
    rates = np.where(ticks[:, np.newaxis] > when, jump, 0.0)
    found = filtered(case, Measured(np.tile(truth[0], (len(ticks), 1)), rates, 0.0 * rates))
    error = attitude_error(found.present, truth)
    np.testing.assert_array_equal(error[: when + 1], 0.0)
    expected = (0.5 - share) * case.period * jump
    np.testing.assert_allclose(error[when + 1 :], np.tile(expected, (149, 1)), atol=1e-10)


def test_against_a_scale_error_a_walk_of_the_bias_helps_and_its_first_variance_does_not() -> None:
    """The numbers of docs/manual/navigation.md: RMS an axis in a turn that comes after a rest."""
    scale, rate, duration = 3e-4, np.radians(1.0), 60.0
    tactical = Case(4e-5, 3e-4, 2.9e-6, 8e-8, 4.8e-6, period=5e-3, interval=40, delay=30)
    time = tactical.period * np.arange(round(2.0 * duration / tactical.period))
    omega, turning = rate * np.array([0.6, 0.0, 0.8]), (time > duration)[:, np.newaxis]
    attitudes = exponential(omega * np.maximum(0.0, time - duration)[:, np.newaxis])
    rates, late = np.where(turning, omega, 0.0), time > duration + 2.0
    flights = [
        measure(tactical, attitudes, rates, np.random.default_rng(seed)) for seed in range(8)
    ]

    def error(scale: float, **assumed: float) -> float:
        case, squares = tactical._replace(**assumed), []
        for seen in flights:
            found = filtered(case, seen._replace(gyro=seen.gyro + scale * rates))
            squares.append(attitude_error(found.present, attitudes)[late] ** 2)
        return float(np.sqrt(np.mean(squares)))

    found = [error(scale), error(scale, rrw=scale * rate / duration**0.5), error(0.0)]
    text = (ROOT / "docs/manual/navigation.md").read_text("utf-8")
    (paragraph,) = (part for part in text.split("\n\n") if "The scale error e of a gyro" in part)
    shown = [float(number) for number in re.findall(r"by (\d\.\de-5)", paragraph)]
    np.testing.assert_allclose(found, shown, atol=0.06e-5)
    assert error(scale, bias=scale * rate) == pytest.approx(found[0], abs=0.06e-5)


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
    # of 199 after the first, each held for ten ticks, one began the filter and one was wrong
    assert (filter.updates, filter.rejected) == (197, 1)
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
    again = 1000 + 10 * (MOST_REJECTED - 1)
    assert (error[1000:again] > 0.2).all()
    assert (error[again + 10 :] < 5e-4).all()
    assert found.bias[again - 1].all()
    assert not found.bias[again].any()
    unknown = np.diag([case.across**2] * 2 + [case.about**2] + [case.bias**2] * 3)
    np.testing.assert_allclose(found.covariance[again], unknown, rtol=1e-12, atol=1e-30)


@settings(max_examples=60)
@given(
    st.integers(0, 2**32 - 1),
    st.sampled_from([1e-9, 1e-5, 1e-2]),
    st.sampled_from([0.0, 1.0, 1e3, 1e25]),
    st.integers(0, 60),
)
def test_attitude_stays_unit_and_covariance_positive_definite(
    seed: int, sigma: float, fastest: float, delay: int
) -> None:
    """Whatever the numbers that arrive, so long as they are finite."""
    rng = np.random.default_rng(seed)
    about = sigma * 10.0 ** rng.uniform(0, 2)
    arw, rrw, bias = 10.0 ** rng.uniform([-9, -12, -8], [-3, -4, -2])
    case = Case(sigma, about, arw, rrw, bias, period=5e-4, delay=delay)
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
