"""Runs and failures that show a share, against the binomial distribution and known numbers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom

from space_robot_control.campaign.verdicts.order_statistics import (
    Outlook,
    allowed_failures,
    bound_rank,
    is_met,
    is_missed,
    outlook,
    runs_needed,
)

shares = st.floats(0.5, 0.999)
confidences = st.floats(0.55, 0.99)


@pytest.mark.parametrize(
    ("share", "confidence", "runs"),
    [
        (0.99865, 0.90, (1705, 2880, 3941, 4947)),  # three sigma of a normal, one-sided
        (0.997, 0.90, (767, 1296, 1773, 2226)),
        (0.9973, 0.90, (852, 1440, 1970, 2473)),
        (0.99, 0.90, (230, 388, 531, 667)),
        (0.95, 0.95, (59, 93, 124, 153)),  # Wilks (1941)
    ],
)
def test_the_fewest_runs_with_no_one_two_and_three_failures(
    share: float, confidence: float, runs: tuple[int, ...]
) -> None:
    assert tuple(runs_needed(k, share, confidence) for k in range(4)) == runs


def test_no_failure_is_a_power_of_the_share() -> None:
    """n with y^n <= 1 - z: ln(1 - z) / ln(y), rounded up."""
    for share in (0.9, 0.95, 0.997, 0.99865):
        exact = np.log(0.1) / np.log(share)
        assert runs_needed(0, share, 0.9) == int(np.ceil(exact))


def test_a_share_that_takes_too_many_runs() -> None:
    assert runs_needed(0, 1.0 - 1e-12, 0.9) is None
    assert outlook(0, 10, 1.0 - 1e-12, 0.9) is None


@settings(max_examples=40)
@given(st.integers(0, 20), shares, confidences)
def test_one_run_fewer_is_too_few(failures: int, share: float, confidence: float) -> None:
    needed = runs_needed(failures, share, confidence)
    assert needed is not None
    risk = [binom.cdf(failures, n, 1.0 - share) for n in (needed - 1, needed)]
    assert risk[1] <= 1.0 - confidence < risk[0] or needed == failures + 1


@settings(max_examples=40)
@given(st.integers(1, 5000), shares, confidences)
def test_one_failure_more_is_too_many(n: int, share: float, confidence: float) -> None:
    allowed = allowed_failures(n, share, confidence)
    if allowed >= 0:
        assert is_met(allowed, n, share, confidence)
    assert not is_met(allowed + 1, n, share, confidence)


@settings(max_examples=60)
@given(
    st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))),
    shares,
    confidences,
)
def test_nothing_is_both_met_and_missed(
    counts: tuple[int, int], share: float, confidence: float
) -> None:
    met, missed = (f(*counts, share, confidence) for f in (is_met, is_missed))
    assert not (met and missed)
    if met:
        assert counts[0] / counts[1] < 1.0 - share
    if missed:
        assert counts[0] / counts[1] > 1.0 - share


@settings(max_examples=60)
@given(
    st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))),
    shares,
    confidences,
)
def test_the_outlook_is_a_decision(
    counts: tuple[int, int], share: float, confidence: float
) -> None:
    failures, n = counts
    found = outlook(failures, n, share, confidence)
    if found is None:
        return
    expected = failures * found.runs / n
    assert found.runs >= n
    if found.met:
        assert is_met(int(np.ceil(expected - 1e-9)), found.runs, share, confidence)
    else:
        assert is_missed(int(np.floor(expected + 1e-9)), found.runs, share, confidence)


def test_the_outlook_without_failure_is_the_fewest_runs() -> None:
    assert outlook(0, 100, 0.997, 0.9) == Outlook(767, True)
    assert outlook(5, 10, 0.997, 0.9) == Outlook(10, False)


@pytest.mark.parametrize("share", [0.9, 0.99])
def test_a_requirement_missed_by_a_little_is_called_met_no_more_often_than_the_risk(
    share: float,
) -> None:
    """The consumer's risk itself, summed over all that can be seen."""
    for n in (100, 500, 2000):
        k = np.arange(n + 1)
        accepted = np.array([is_met(failures, n, share, 0.9) for failures in k[: n // 4]])
        assert binom.pmf(k[: n // 4], n, 1.0 - share)[accepted].sum() <= 0.1 + 1e-12


@pytest.mark.parametrize(("n", "share"), [(59, 0.95), (500, 0.95), (1000, 0.99)])
def test_the_bound_holds_in_the_share_of_cases_as_often_as_said(n: int, share: float) -> None:
    """2000 campaigns of uniform numbers, whose quantile is the share itself."""
    rank = bound_rank(n, share, 0.9)
    assert rank is not None
    drawn = np.random.default_rng(5).uniform(size=(2000, n))
    bounds = np.partition(drawn, rank - 1)[:, rank - 1]
    covered = np.mean(bounds >= share)
    assert covered >= 0.9 - 3 * np.sqrt(0.09 / 2000)
    assert bound_rank(20, 0.95, 0.9) is None
