"""Laws side by side, quantiles, influences on a metric: by SciPy, and by simulation."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from campaign_tables import made_table
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import (
    binom,
    binomtest,
    false_discovery_control,
    kruskal,
    norm,
    qmc,
    rankdata,
    spearmanr,
)
from scipy.stats import sobol_indices as scipy_sobol

from space_robot.campaign.verdicts.influences import indices, sensitivity, sobol_indices
from space_robot.campaign.verdicts.laws import compare, compare_all, holm, league, quantile
from space_robot.campaign.verdicts.rows import independent_rows, saltelli_values

numbers = st.one_of(st.floats(1e-6, 1e3), st.just(np.inf))


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


def test_the_league_ranks_what_is_shown() -> None:
    found = league(made_table(200, failing=0.0), "metric.attitude.rms")
    assert [(s.law, s.rank) for s in found.standings] == [
        ("ctc", 1),
        ("tde_stc", 2),
        ("tde_tsmc=robust", 3),
    ]
    (first, *_) = found.comparisons
    assert first.ratio.low < 1 / 1.5 < first.ratio.high


def test_laws_without_a_shown_difference_share_a_rank() -> None:
    table = made_table(30, laws=("a", "b"), failing=0.0)
    table["metric.attitude.rms"] = np.random.default_rng(0).uniform(size=len(table))
    assert [s.rank for s in league(table, "metric.attitude.rms").standings] == [1, 1]


def test_only_runs_that_both_flew_are_compared() -> None:
    table = made_table(50, laws=("a", "b"))
    rows = table[(table["law"] == "a") | (table["run"] < 20)]
    assert [c.runs for c in compare_all(rows, "metric.attitude.rms")] == [20]


def test_a_known_interval_of_a_median() -> None:
    """Of ten numbers the 2nd to the 9th hold the median at 97.9 %: the shortest for 95 %."""
    assert quantile(np.arange(1.0, 11.0), 0.5, 0.95)[1:] == (2.0, 9.0)
    assert quantile(np.array([1.0, 2.0]), 0.5)[1:] == (-np.inf, np.inf)
    assert quantile(np.arange(100.0), 0.99).high == np.inf


@given(st.lists(st.one_of(st.floats(0.0, 1e9), st.just(np.inf)), min_size=1), st.floats(0.01, 0.99))
def test_it_is_a_number_that_was_seen_within_its_interval(
    values: list[float], share: float
) -> None:
    value, low, high = quantile(np.array(values), share)
    assert value in values
    assert low <= value <= high
    assert value == np.quantile(values, share, method="inverted_cdf") or np.isclose(
        share * len(values), round(share * len(values))
    )


def table_of(variables: dict[str, object], metric: np.ndarray) -> pd.DataFrame:
    return pd.DataFrame(
        {
            "run": range(len(metric)),
            "law": "ctc",
            "outcome": "complete",
            **{f"vary.{name}": values for name, values in variables.items()},
            "metric.x": metric,
        }
    )


def test_partial_correlations_are_those_of_residuals_for_every_variable() -> None:
    """Variables that go together, with texts between them; intervals and R squared by hand."""
    rng, runs = np.random.default_rng(2), 120
    x, y, w = rng.normal(size=(3, runs))
    numbers = {"x": x, "y": 0.7 * x + y, "w": w - 0.5 * y}
    z = x - 1.5 * y + 0.3 * w + rng.normal(size=runs)
    kind = rng.choice(["a", "b", "c"], runs)
    variables = {"x": numbers["x"], "kind": kind, "y": numbers["y"], "w": numbers["w"]}
    found = sensitivity(table_of(variables, z), "ctc", "metric.x", 0.9)
    assert found is not None
    ranks = {name: rankdata(values) for name, values in numbers.items()}
    ranked = rankdata(z)

    def residuals(of: np.ndarray, names: list[str]) -> np.ndarray:
        others = np.column_stack([np.ones(runs), *(ranks[name] for name in names)])
        left: np.ndarray = of - others @ np.linalg.lstsq(others, of, rcond=None)[0]
        return left

    def interval(r: float, held: int) -> tuple[float, float]:
        half = norm.ppf(0.95) * np.sqrt((1.0 + r**2 / 2.0) / (runs - 3 - held))
        return float(np.tanh(np.arctanh(r) - half)), float(np.tanh(np.arctanh(r) + half))

    by_name = {i.variable: i for i in found.influences}
    for name in numbers:
        others = [other for other in numbers if other != name]
        partial, plain = by_name[name].partial, by_name[name].correlation
        assert partial is not None
        assert plain is not None
        r = np.corrcoef(residuals(ranks[name], others), residuals(ranked, others))[0, 1]
        assert partial.value == pytest.approx(r)
        assert partial[1:] == pytest.approx(interval(r, len(others)))
        assert plain.value == pytest.approx(spearmanr(numbers[name], z)[0])
        assert plain[1:] == pytest.approx(interval(plain.value, 0))
    assert by_name["kind"].partial is None
    left = residuals(ranked, list(numbers))
    r_squared = 1.0 - left.var() / ranked.var()
    assert found.explained == pytest.approx(1.0 - (1.0 - r_squared) * (runs - 1) / (runs - 4))


def test_texts_are_compared_by_groups() -> None:
    rng = np.random.default_rng(4)
    kind = rng.choice(["a", "b", "c"], 90)
    metric = rng.normal(size=90) + 2.0 * (kind == "b")
    found = sensitivity(table_of({"kind": kind}, metric), "ctc", "metric.x")
    assert found is not None
    (influence,) = found.influences
    assert influence.correlation is None
    expected = kruskal(*(metric[kind == k] for k in "abc"))
    assert influence.p == pytest.approx(expected.pvalue)
    assert influence.spread == pytest.approx((expected.statistic - 2) / 87)
    assert found.explained is None


def test_nothing_is_said_of_what_does_not_vary() -> None:
    table = made_table(50, failing=1.1)
    assert sensitivity(table, "ctc", "metric.attitude.rms") is None
    assert sensitivity(made_table(5), "ctc", "metric.attitude.rms") is None


def ishigami(x: np.ndarray) -> np.ndarray:
    """x (..., 3) within +-pi; a = 7, b = 0.1."""
    a, b, c = np.moveaxis(x, -1, 0)
    found: np.ndarray = np.sin(a) + 7.0 * np.sin(b) ** 2 + 0.1 * c**4 * np.sin(a)
    return found


def saltelli_rows(count: int) -> np.ndarray:
    """(count, 5, 3): A, A with each variable of B, B."""
    drawn = np.pi * (2.0 * qmc.Sobol(6, rng=np.random.default_rng(1)).random(count) - 1.0)
    a, b = drawn[:, :3], drawn[:, 3:]
    mixed = [np.where(np.arange(3) == i, b, a) for i in range(3)]
    return np.stack([a, *mixed, b], axis=1)


def test_the_indices_are_scipys() -> None:
    values = ishigami(saltelli_rows(256))
    blocks = {"f_A": values[:, 0], "f_B": values[:, -1], "f_AB": values[:, 1:-1].T[:, np.newaxis]}
    expected = scipy_sobol(func={k: np.atleast_2d(v) for k, v in blocks.items()}, n=256)
    first, total = indices(values)
    np.testing.assert_allclose(first, np.ravel(expected.first_order), rtol=1e-9)
    np.testing.assert_allclose(total, np.ravel(expected.total_order), rtol=1e-9)


def test_rows_with_a_failed_flight_are_left_out_and_counted() -> None:
    values = ishigami(saltelli_rows(64))
    values[[3, 9], [0, 4]] = np.inf
    found = sobol_indices(values, ["x1", "x2", "x3"])
    assert found is not None
    assert (found.rows, found.left_out) == (62, 2)
    assert sobol_indices(np.full((9, 5), np.nan), ["x1", "x2", "x3"]) is None


def test_a_table_of_the_design_becomes_its_rows() -> None:
    """Runs in any order; one is missing, one failed."""
    table = table_of(dict.fromkeys("abc", 0.0), np.arange(10.0))
    table.loc[3, "outcome"] = "diverged"
    table = table.drop(index=7).sample(frac=1.0, random_state=1)
    found = saltelli_values(table, "ctc", "metric.x")
    np.testing.assert_array_equal(found, [[0, 1, 2, np.inf, 4], [5, 6, np.nan, 8, 9]])
    assert sorted(independent_rows(table, "saltelli")["run"]) == [0, 4, 5, 9]
    assert len(independent_rows(table, "sobol")) == 9
