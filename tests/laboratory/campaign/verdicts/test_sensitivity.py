"""Influences on a metric: SciPy's correlations, known partial ones, shapes, words; Sobol's."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from campaign_tables import made_table
from scipy.stats import kruskal, norm, qmc, rankdata, spearmanr
from scipy.stats import sobol_indices as scipy_sobol

from space_robot.campaign.verdicts.design import independent_rows, saltelli_values
from space_robot.campaign.verdicts.sensitivity import rank_correlations, sensitivity
from space_robot.campaign.verdicts.sobol import indices, sobol_indices


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


def test_a_variable_that_others_determine_has_no_partial_correlation() -> None:
    x = np.random.default_rng(2).normal(size=50)
    _, partial, _ = rank_correlations([x, 2.0 * x], rankdata(x))
    assert partial == [None, None]


def test_intervals_cover_the_correlation_as_often_as_said() -> None:
    """Normal numbers of correlation 0.6, whose ranks' is 6 / pi asin(0.3)."""
    rng, true = np.random.default_rng(7), 6.0 / np.pi * np.arcsin(0.3)
    covered = 0
    for _ in range(500):
        x, noise = rng.normal(size=(2, 150))
        (found,), _, _ = rank_correlations([x], rankdata(0.6 * x + 0.8 * noise))
        covered += found.low <= true <= found.high
    assert covered / 500 >= 0.95 - 3 * np.sqrt(0.95 * 0.05 / 500)


def test_what_drives_the_error_comes_first_and_what_does_not_is_insignificant() -> None:
    found = sensitivity(made_table(400), "ctc", "metric.attitude_rms")
    assert found is not None
    assert found.influences[0].variable == "robot.base.mass"
    by_name = {i.variable: i for i in found.influences}
    assert by_name["unused"].p > 0.05
    scale = by_name["faults.torque_scale@0:all"]
    assert scale.correlation is not None
    assert abs(scale.correlation.value) < 0.2  # the error grows to both sides
    assert scale.p < 1e-3
    assert scale.spread > 0.03


def test_words_are_told_by_groups() -> None:
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


def test_failed_flights_are_worst_of_all() -> None:
    table = made_table(200, failing=0.0)
    heavy = table["vary.robot.base.mass"] > 1.1
    table.loc[heavy, "outcome"] = "diverged"
    table.loc[heavy, "metric.attitude_rms"] = np.nan
    found = sensitivity(table, "ctc", "metric.attitude_rms")
    assert found is not None
    best = found.influences[0]
    assert best.variable == "robot.base.mass"
    assert best.correlation is not None
    assert best.correlation.low > 0.8


def test_nothing_is_said_of_what_does_not_vary() -> None:
    table = made_table(50, failing=1.1)
    assert sensitivity(table, "ctc", "metric.attitude_rms") is None
    assert sensitivity(made_table(5), "ctc", "metric.attitude_rms") is None


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


def test_the_indices_of_ishigami() -> None:
    """Ishigami and Homma (1990): first 0.314, 0.442, 0; total 0.558, 0.442, 0.244."""
    found = sobol_indices(ishigami(saltelli_rows(4096)), ["x1", "x2", "x3"])
    assert found is not None
    exact = {"x1": (0.314, 0.558), "x2": (0.442, 0.442), "x3": (0.0, 0.244)}
    assert [i.variable for i in found.indices] == ["x1", "x2", "x3"]
    for index in found.indices:
        first, total = exact[index.variable]
        assert index.first.value == pytest.approx(first, abs=0.02)
        assert index.total.value == pytest.approx(total, abs=0.02)
        assert index.first.low < first < index.first.high
        assert index.total.low < total < index.total.high


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
    table = pd.DataFrame(
        {
            "run": range(10),
            "law": "ctc",
            "outcome": "complete",
            "vary.a": 0.0,
            "vary.b": 0.0,
            "vary.c": 0.0,
            "metric.x": np.arange(10.0),
        }
    )
    table.loc[3, "outcome"] = "diverged"
    table = table.drop(index=7).sample(frac=1.0, random_state=1)
    found = saltelli_values(table, "ctc", "metric.x")
    np.testing.assert_array_equal(found, [[0, 1, 2, np.inf, 4], [5, 6, np.nan, 8, 9]])
    assert sorted(independent_rows(table, "saltelli")["run"]) == [0, 4, 5, 9]
    assert len(independent_rows(table, "sobol")) == 9
