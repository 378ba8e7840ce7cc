"""Verdicts on a share: known numbers, exact probabilities of false ones, integrals by SciPy."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from paths import DOCS
from scipy.integrate import quad
from scipy.stats import beta, binom

from space_robot.campaign.verdicts.requirements import projected_decision
from space_robot.campaign.verdicts.share_test import (
    FixedSample,
    Sequential,
    ShareTest,
    log_evidence,
)

_spec = importlib.util.spec_from_file_location("exact", DOCS / "campaign_statistics.py")
assert _spec is not None
assert _spec.loader is not None
exact = importlib.util.module_from_spec(_spec)
_spec.loader.exec_module(exact)

KINDS = [FixedSample, Sequential]
shares = st.floats(0.5, 0.999)
confidences = st.floats(0.55, 0.99)
counts = st.integers(1, 400).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n)))
kinds = st.sampled_from(KINDS)


@pytest.mark.parametrize(
    ("share", "confidence", "runs"),
    [
        (0.99865, 0.90, (1705, 2880, 3941, 4947)),  # three sigma of a normal, one-sided
        (0.997, 0.90, (767, 1296, 1773, 2226)),
        (0.99, 0.90, (230, 388, 531, 667)),
        (0.95, 0.95, (59, 93, 124, 153)),  # Wilks (1941)
    ],
)
def test_a_fixed_sample_needs_the_published_numbers_of_runs(
    share: float, confidence: float, runs: tuple[int, ...]
) -> None:
    test = FixedSample(share, confidence)
    assert tuple(test.runs_needed(k) for k in range(4)) == runs


def test_a_share_that_takes_too_many_runs() -> None:
    for kind in KINDS:
        assert kind(1.0 - 1e-12, 0.9).runs_needed(0) is None
    assert projected_decision(Sequential(1.0 - 1e-12, 0.9), 0, 10) is None
    assert projected_decision(Sequential(0.75, 0.9), 25, 100) is None  # as often as allowed


@settings(max_examples=40, deadline=None)
@given(kinds, st.integers(1, 2000), shares, confidences)
def test_the_most_failures_and_the_fewest_runs_are_just_enough(
    kind: type[ShareTest], runs: int, share: float, confidence: float
) -> None:
    test = kind(share, confidence)
    allowed = test.allowed_failures(runs)
    assert not test.is_met(allowed + 1, runs)
    assert test.bound_rank(runs) == (runs - allowed if allowed >= 0 else None)
    if allowed >= 0:
        assert test.is_met(allowed, runs)
        needed = test.runs_needed(allowed)
        assert needed is not None
        assert allowed < needed <= runs
        assert not test.is_met(allowed, needed - 1) or needed == allowed + 1


@settings(max_examples=60, deadline=None)
@given(kinds, counts, shares, confidences)
def test_limits_and_verdicts_say_the_same(
    kind: type[ShareTest], seen: tuple[int, int], share: float, confidence: float
) -> None:
    test, (low, high) = kind(share, confidence), kind(share, confidence).limits(*seen)
    met, missed = bool(test.is_met(*seen)), bool(test.is_missed(*seen))
    assert not (met and missed)
    assert low <= 1.0 - seen[0] / seen[1] <= high
    assume(min(abs(low - share), abs(high - share)) > 1e-9)
    assert (low > share, high < share) == (met, missed)


@settings(max_examples=40, deadline=None)
@given(counts, st.floats(0.02, 0.98))
def test_evidence_is_the_average_likelihood_over_the_one_at_the_share(
    seen: tuple[int, int], share: float
) -> None:
    """Against an integral over Jeffreys' weights below the share, p = sin(t) squared."""
    events, runs = seen
    top = np.arcsin(np.sqrt(share))
    at_share = binom.pmf(events, runs, share)
    assume(at_share > 1e-200)

    def ratio(t: float) -> float:
        return float(binom.pmf(events, runs, np.sin(t) ** 2) / at_share)

    peak = float(np.arcsin(np.sqrt(events / runs)))
    area, _ = quad(ratio, 0.0, top, points=[min(peak, top)], limit=400)
    assume(area > 1e-8)
    assert log_evidence(events, runs, share) == pytest.approx(np.log(area / top), abs=1e-5)


@settings(max_examples=100, deadline=None)
@given(counts, st.floats(0.02, 0.98), st.floats(0.0, 1.0))
def test_evidence_is_a_martingale_at_the_share_and_falls_above(
    seen: tuple[int, int], share: float, more: float
) -> None:
    """What makes it valid at any stop, whatever the formula: the mean of the next is the last."""
    events, runs = seen
    now = log_evidence(events, runs, share)
    assume(now > -300.0)
    event, none = np.exp(
        [
            log_evidence(events + 1, runs + 1, share) - now,
            log_evidence(events, runs + 1, share) - now,
        ]
    )
    assert share * event + (1.0 - share) * none == pytest.approx(1.0, rel=1e-8)
    above = share + more * (1.0 - share)
    assert above * event + (1.0 - above) * none <= 1.0 + 1e-8
    assert log_evidence(0, 0, share) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("share", "confidence"), [(0.9, 0.9), (0.7, 0.8), (0.98, 0.95)])
def test_no_way_of_looking_and_flying_on_makes_false_verdicts_more_frequent(
    share: float, confidence: float
) -> None:
    """Exactly; order statistics, looked at that often, are false far more often than said."""
    error = 1.0 - confidence
    fixed, sequential = (exact.Rule(k(share, confidence), 120, 1000) for k in KINDS)
    for rule in (fixed, sequential):
        assert max(rule.looking(200, most=200)) <= error
    often = sequential.looking(1)
    assert max(often) <= error
    assert min(often) > 0.3 * error  # nor is it much too careful
    for every in (7, 50):
        assert max(sequential.looking(every)) <= min(error, max(often))
    assert max(sequential.flying_on(lambda k, _: int(sequential.met_from[k]))) <= error
    assert max(fixed.looking(50)) > 1.3 * error
    assert max(fixed.flying_on(lambda k, _: int(fixed.met_from[k]))) > 1.3 * error


def test_the_page_on_campaigns_has_the_exact_probabilities() -> None:
    """The rows that take little time."""
    page = (DOCS / "explanation/campaign_statistics.md").read_text("utf-8")
    before, now = (exact.rules(kind(exact.SHARE, exact.CONFIDENCE)) for kind in KINDS)
    for name in [name for name in before if "until:" not in name and "every run" not in name]:
        errors = [*before[name](), *now[name]()]
        assert " | ".join([f"| {name}", *(f"{100.0 * e:.1f} %" for e in errors)]) in page, name


def test_a_fixed_sample_covers_the_share_as_often_as_said() -> None:
    """Summed over all that can be seen, not sampled."""
    for share in (0.5, 0.9, 0.997):
        test, failures = FixedSample(share, 0.9), np.arange(301)
        probability = binom.pmf(failures, 300, 1.0 - share)
        assert probability[test.is_met(failures, 300)].sum() <= 0.1
        assert probability[test.is_missed(failures, 300)].sum() <= 0.1


def test_the_two_sided_interval_has_half_the_error_on_either_side() -> None:
    for failures, runs in ((0, 50), (3, 50), (47, 50)):
        interval = Sequential(0.9, 0.9).interval(failures, runs)
        low, high = 1.0 - np.array(interval)
        for events, share in ((failures, low), (runs - failures, 1.0 - high)):
            if 0.0 < share < 1.0:
                assert log_evidence(events, runs, share) == pytest.approx(np.log(20.0), abs=1e-6)
        inner = beta.ppf([0.05, 0.95], runs - failures + 0.5, failures + 0.5)
        assert interval.low < inner[0] < inner[1] < interval.high or failures in (0, runs)
    assert Sequential(0.9, 0.9).interval(0, 0) == (0.0, 1.0)


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from([0.5, 0.8, 0.95, 0.99, 0.997]),
    st.sampled_from([0.6, 0.9, 0.99]),
    st.integers(1, 400),
    st.floats(0.0, 2.5),
)
def test_the_projected_decision_is_the_first_of_all(
    share: float, confidence: float, runs: int, frequency: float
) -> None:
    """Against every number of runs in turn, failures rounded against the decision."""
    test = Sequential(share, confidence)
    failures = min(runs, round(runs * (1.0 - share) * frequency))
    assume(not test.is_met(failures, runs) and not test.is_missed(failures, runs))
    assume(failures / runs != 1.0 - share)
    n, met = np.arange(runs, 8000), failures / runs < 1.0 - share
    if met:
        decided = test.is_met(-(-failures * n // runs), n)
    else:
        decided = test.is_missed(failures * n // runs, n)
    found = projected_decision(test, failures, runs)
    if decided.any():
        assert found == (n[np.argmax(decided)], met)
    else:
        assert found is None or found.runs >= 8000
