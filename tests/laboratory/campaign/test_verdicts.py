"""Verdicts on shares and requirements: known counts, exact probabilities, integrals by SciPy."""

from __future__ import annotations

import importlib.util
import json

import numpy as np
import pandas as pd
import pytest
from campaign_tables import made_table
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from paths import DOCS
from scipy.stats import beta

from space_robot.campaign.study import Requirement, Study
from space_robot.campaign.verdicts.requirements import (
    FixedSample,
    Sequential,
    ShareTest,
    Verdict,
    log_evidence,
    projected_decision,
    share_interval,
    verdict,
    verdicts,
)


@given(
    st.integers(1, 3000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))),
    st.floats(0.5, 0.999),
)
def test_both_ends_are_quantiles_of_beta(pair: tuple[int, int], confidence: float) -> None:
    k, n = pair
    tail = 0.5 * (1.0 - confidence)
    low = beta.ppf(tail, k, n - k + 1) if k else 0.0
    high = beta.ppf(1.0 - tail, k + 1, n - k) if k < n else 1.0
    assert share_interval(k, n, confidence) == pytest.approx((low, high), rel=1e-6, abs=1e-12)
    limits = FixedSample(0.9, 1.0 - tail).limits(n - k, n)
    assert limits == pytest.approx((low, high), rel=1e-6, abs=1e-12)
    assert share_interval(0, 0, 0.9) == (0.0, 1.0)


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
    demand = demand_of(1.0, None, share, confidence)
    for missing, word in ((0, "met"), (1, "undecided")):
        found = judge(demand, rows([0.5] * (runs[1] - 1 - missing), failed=1))
        assert (found.word, found.failures) == (word, 1)


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


def test_the_page_on_campaigns_has_the_exact_probabilities() -> None:
    """The rows that take little time."""
    page, kept = exact.PAGE.read_text("utf-8"), json.loads(exact.KEPT.read_text("utf-8"))
    assert exact.renewed(page, kept) == page
    before, now = (exact.rules(kind(exact.SHARE, exact.CONFIDENCE)) for kind in KINDS)
    for name in [name for name in before if "until:" not in name and "every run" not in name]:
        assert kept[name] == pytest.approx([*before[name](), *now[name]()], rel=1e-6)


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


def demand_of(
    below: float | None = None,
    above: float | None = None,
    share: float = 0.997,
    confidence: float = 0.9,
) -> Requirement:
    return Requirement.model_validate(
        {"metric": "x", "below": below, "above": above, "in": share, "confidence": confidence}
    )


def rows(values: list[float], failed: int = 0, outcome: str = "diverged") -> pd.DataFrame:
    """Flights with these numbers, and so many more that did not come to their end."""
    outcomes = ["complete"] * len(values) + [outcome] * failed
    return pd.DataFrame(
        {
            "run": range(len(outcomes)),
            "law": "ctc",
            "outcome": outcomes,
            "require.x": [*values, *[0.0] * failed],
        }
    )


def judge(
    demand: Requirement, table: pd.DataFrame, kind: type[ShareTest] | None = FixedSample
) -> Verdict:
    return verdict("x", demand, table, kind)


def test_a_fixed_sample_shows_nothing_before_it_is_complete() -> None:
    found = judge(demand_of(1.0), rows([0.5] * 5000), None)
    assert (found.word, found.limits, found.bound) == ("undecided", (0.0, 1.0), None)
    table = made_table(100, laws=("ctc", "tde_stc"), failing=0.0)
    require = {"pointing": {"metric": "attitude.max", "below": 1.0, "in": 0.9}}
    for key, words in (
        ({"fixed_runs": True}, ("undecided", "met")),
        ({"design": "latin_hypercube"}, ("undecided", "met")),
        ({}, ("met", "met")),
    ):
        study = Study.model_validate({"laws": ["ctc", "tde_stc"], "require": require, **key})
        some, whole = (verdicts(table, study, runs)[0].word for runs in (101, 100))
        assert (some, whole) == words


def test_what_is_not_measured_speaks_against_every_verdict() -> None:
    """A flight that came to its end without the number neither meets nor misses anything."""
    demand = demand_of(1.0, share=0.9)
    for kind in (FixedSample, Sequential):
        found = judge(demand, rows([np.nan] * 50), kind)
        assert (found.word, found.failures, found.not_measured, found.met) == (
            "not measured",
            0,
            50,
            0,
        )
        assert found.limits == (0.0, 1.0)
        assert found.projected_decision is None
        assert judge(demand, rows([0.5] * 200 + [np.nan] * 2), kind).word == "met"
        assert judge(demand, rows([0.5] * 200 + [np.nan] * 20), kind).word == "not measured"
        assert judge(demand, rows([2.0] * 50 + [np.nan] * 50), kind).word == "not met"
        mixed = judge(demand, rows([0.5] * 30 + [np.nan] * 5, failed=3), kind)
        assert (mixed.failures, mixed.not_measured, mixed.met) == (3, 5, 30)
        low, high = (judge(demand, rows([0.5] * 30 + [v] * 5, failed=3), kind) for v in (2.0, 0.5))
        assert mixed.limits == (low.limits.low, high.limits.high)


@pytest.mark.parametrize("outcome", ["diverged", "killed", "out_of_time", "refused", "unanswered"])
def test_a_flight_that_did_not_end_is_a_failure_whatever_its_number(outcome: str) -> None:
    found = judge(demand_of(1.0), rows([0.5] * 9, failed=1, outcome=outcome))
    assert (found.failures, found.not_ended) == (1, 1)
    assert found.external == (outcome in ("killed", "out_of_time", "refused"))
    above = judge(demand_of(above=-1.0), rows([0.5] * 9, failed=1, outcome=outcome))
    assert above.failures == 1


def test_the_bound_counts_failed_flights_as_infinite() -> None:
    """Of 59 runs the largest bounds 95 % at 95 %, of 93 the second largest."""
    demand = demand_of(100.0, share=0.95, confidence=0.95)
    numbers = [float(n) for n in range(1, 94)]
    assert judge(demand, rows(numbers[:59])).bound == 59.0
    assert judge(demand, rows(numbers)).bound == 92.0
    assert judge(demand, rows(numbers[:-1], failed=1)).bound == 92.0
    assert judge(demand, rows(numbers[:58], failed=1)).bound == np.inf
    assert judge(demand, rows(numbers[:58])).bound is None


@settings(max_examples=40)
@given(
    st.lists(st.floats(0.0, 2.0), min_size=1, max_size=200),
    st.integers(0, 5),
    st.floats(0.5, 0.98),
    st.floats(0.55, 0.95),
    st.sampled_from([FixedSample, Sequential]),
)
def test_bound_limits_and_verdict_say_the_same(
    values: list[float], failed: int, share: float, confidence: float, kind: type[ShareTest]
) -> None:
    found = judge(demand_of(1.0, None, share, confidence), rows(values, failed), kind)
    by_bound = found.bound is not None and found.bound < 1.0
    assert by_bound == (found.word == "met")
    if abs(found.limits.low - share) > 1e-9:
        assert (found.limits.low > share) == (found.word == "met")
    if abs(found.limits.high - share) > 1e-9:
        assert (found.limits.high < share) == (found.word == "not met")
