"""Laws side by side: exact tests, intervals, failures, Holm's correction."""

from __future__ import annotations

import numpy as np
import pytest
from campaign_tables import made_table
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binom, binomtest, false_discovery_control, wilcoxon

from space_robot.campaign.verdicts.league import league
from space_robot.campaign.verdicts.paired import compare, compare_all, holm
from space_robot.campaign.verdicts.quantiles import quantile

numbers = st.one_of(st.floats(1e-6, 1e3), st.just(np.inf))


def test_better_in_nine_of_ten_runs_by_hand() -> None:
    """Sign test: 2 (1 + 10) / 2^10; the median's interval is the 2nd to the 9th ratio."""
    b = np.ones(10)
    a = np.array([0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 2.0])
    found = compare(a, b)
    assert (found.better, found.worse) == (9, 1)
    assert found.p_better == pytest.approx(22 / 1024)
    assert found.ratio == (0.5, 0.2, 0.9)
    assert found.finding == "better"
    assert compare(b, a).finding == "worse"


def test_failing_is_worse_than_any_number_and_two_that_fail_are_alike() -> None:
    a, b = np.array([1.0, np.inf, np.inf, 1.0]), np.array([np.inf, 5.0, np.inf, 1.0])
    found = compare(a, b)
    assert (found.better, found.worse, found.failed, found.other_failed) == (1, 1, 1, 1)


@settings(max_examples=50)
@given(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=40))
def test_every_number_of_a_comparison_is_that_of_counting(pairs: list[tuple[float, float]]) -> None:
    """Two failed flights have the ratio 1, one alone an infinite one or 0."""
    found = compare(*np.array(pairs).T, 0.9, "one", "two")
    ratios = [
        1.0 if a == b else 0.0 if b == np.inf else np.inf if a == np.inf else a / b
        for a, b in pairs
    ]
    better, worse = sum(a < b for a, b in pairs), sum(a > b for a, b in pairs)
    alone = [sum(np.isinf(p[k]) and not np.isinf(p[1 - k]) for p in pairs) for k in (0, 1)]
    assert (found.law, found.other, found.runs) == ("one", "two", len(pairs))
    assert (found.better, found.worse, found.failed, found.other_failed) == (better, worse, *alone)
    assert found.ratio == quantile(np.array(ratios), 0.5, 0.9)
    for p, (k, m) in ((found.p_better, (better, worse)), (found.p_failed, alone)):
        assert p == pytest.approx(min(1.0, 2.0 * binom.cdf(min(k, m), k + m, 0.5)))
    share = binomtest(better, len(pairs)).proportion_ci(0.9)
    assert found.better_share == pytest.approx((share.low, share.high))


def test_better_in_most_runs_but_failing_more_often_is_called_contradictory() -> None:
    b = np.full(100, 2.0)
    a = np.where(np.arange(100) < 20, np.inf, 1.0)
    assert compare(a, b).finding == "contradictory"
    assert compare(np.where(np.isinf(a), a, 2.0), b).finding == "worse"


@settings(max_examples=50)
@given(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=60))
def test_nobody_is_better_where_the_interval_holds_1(pairs: list[tuple[float, float]]) -> None:
    a, b = np.array(pairs).T
    found, turned = compare(a, b), compare(b, a)
    by_failures = found.p_failed <= 0.05
    if found.finding in ("better", "worse") and not by_failures:
        assert not found.ratio.low <= 1.0 <= found.ratio.high
        assert found.p_better <= 0.05
    opposite = {"better": "worse", "worse": "better"}
    assert turned.finding == opposite.get(found.finding, found.finding)


def test_alike_laws_are_seldom_called_better() -> None:
    """200 campaigns of two laws with the same distribution: 5 % false findings at most."""
    drawn = np.random.default_rng(3).lognormal(size=(200, 2, 200))
    false = sum(compare(*pair).finding != "alike" for pair in drawn)
    assert false <= 200 * 0.05 + 3 * np.sqrt(200 * 0.05 * 0.95)


def test_a_shift_that_wilcoxon_sees_is_seen() -> None:
    rng = np.random.default_rng(8)
    b = rng.lognormal(size=300)
    a = b * rng.lognormal(-0.1, 0.2, size=300)
    assert wilcoxon(np.log(a / b)).pvalue < 1e-3
    found = compare(a, b)
    assert found.finding == "better"
    assert found.ratio.low < np.exp(-0.1) < found.ratio.high


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20))
def test_holm_lies_between_no_correction_and_bonferroni(p_values: list[float]) -> None:
    corrected = holm(p_values)
    count = len(p_values)
    for p, q in zip(p_values, corrected, strict=True):
        assert p <= q <= min(1.0, count * p) + 1e-15
    assert min(corrected) == pytest.approx(min(1.0, count * min(p_values)))
    order = np.argsort(p_values)
    assert np.all(np.diff(np.array(corrected)[order]) >= 0.0)
    # Holm never rejects what Benjamini and Hochberg's weaker criterion keeps
    assert np.all(np.array(corrected) >= false_discovery_control(p_values) - 1e-12)


def test_holm_of_a_textbook() -> None:
    assert holm([0.01, 0.04, 0.03, 0.005]) == pytest.approx([0.03, 0.06, 0.06, 0.02])


def test_the_league_ranks_what_is_shown() -> None:
    found = league(made_table(200, failing=0.0), "metric.attitude_rms")
    assert [(s.law, s.rank) for s in found.standings] == [
        ("ctc", 1),
        ("tde_stc", 2),
        ("tde_tsmc=robust", 3),
    ]
    (first, *_) = found.comparisons
    assert first.ratio.low < 1 / 1.5 < first.ratio.high


def test_laws_that_are_not_told_apart_share_a_rank() -> None:
    table = made_table(30, laws=("a", "b"), failing=0.0)
    table["metric.attitude_rms"] = np.random.default_rng(0).uniform(size=len(table))
    assert [s.rank for s in league(table, "metric.attitude_rms").standings] == [1, 1]


def test_only_runs_that_both_flew_are_compared() -> None:
    table = made_table(50, laws=("a", "b"))
    (found,) = compare_all(
        table[(table["law"] == "a") | (table["run"] < 20)], "metric.attitude_rms"
    )
    assert found.runs == 20


def test_a_campaign_of_failed_flights_has_a_league() -> None:
    found = league(made_table(20, failing=1.1), "metric.attitude_rms")
    assert {s.rank for s in found.standings} == {1}
    assert {s.failures for s in found.standings} == {20}
