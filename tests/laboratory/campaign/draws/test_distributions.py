"""Distributions against SciPy's, and against what they must never give."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from space_robot.campaign.draws.distributions import read_distribution
from space_robot.campaign.draws.keys import bits, noise_seed, permutation, uniform

GOLDEN_BITS = [1788990827981690842, 15618775813144590017]
GOLDEN_UNIFORM = "0x1.1c18746dcd574p-3"
GOLDEN_NORMAL = "0x1.e65d1e31310b2p-1"
GOLDEN_SEED = 832400951
GOLDEN_PERMUTATION = [1, 4, 5, 0, 2, 3, 6, 7]
SHARES = st.floats(2.0**-53, 1.0 - 2.0**-53)
KNOWN: list[tuple[dict[str, Any], Any]] = [
    ({"normal": 3.0, "sigma": 0.5}, stats.norm(3.0, 0.5)),
    ({"normal": 0.0, "sigma": 2.0, "low": -1.0}, stats.truncnorm(-0.5, np.inf, 0.0, 2.0)),
    ({"normal": 0.0, "sigma": 2.0, "low": -3.0, "high": 1.0}, stats.truncnorm(-1.5, 0.5, 0.0, 2.0)),
    ({"normal": 3.0, "sigma": 0.5, "low": 2.8}, stats.truncnorm(-0.4, np.inf, 3.0, 0.5)),
    ({"normal": 3.0, "sigma": 0.5, "high": 3.2}, stats.truncnorm(-np.inf, 0.4, 3.0, 0.5)),
    ({"normal": -3.0, "sigma": 0.5, "low": -2.0, "high": -1.5}, stats.truncnorm(2, 3, -3.0, 0.5)),
    ({"uniform": [-2.0, 5.0]}, stats.uniform(-2.0, 7.0)),
    ({"log_uniform": [1e-3, 10.0]}, stats.loguniform(1e-3, 10.0)),
]


@pytest.mark.parametrize(("told", "known"), KNOWN, ids=[str(told) for told, _ in KNOWN])
def test_quantiles_are_scipys(told: dict[str, Any], known: Any) -> None:
    distribution = read_distribution(told, "here")
    for u in (1e-12, 1e-3, 0.1, 0.5, 0.77, 0.999, 1.0 - 1e-9):
        expected = known.ppf(u)
        if known.args[1:2] == (np.inf,):  # SciPy 1.15 is 1e-8 off in the tail of a truncated one
            low, _, mean, sigma = known.args
            expected = mean + sigma * stats.norm.isf((1.0 - u) * stats.norm.sf(low))
        assert distribution.quantile(u) == pytest.approx(expected, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(("told", "known"), KNOWN, ids=[str(told) for told, _ in KNOWN])
def test_draws_are_of_the_distribution(told: dict[str, Any], known: Any) -> None:
    distribution = read_distribution(told, "here")
    drawn = [distribution.quantile(uniform(5, "x", number)) for number in range(4000)]
    assert stats.kstest(drawn, known.cdf).pvalue > 1e-3
    assert np.mean(drawn) == pytest.approx(known.mean(), abs=5.0 * known.std() / 4000**0.5)


@given(SHARES)
def test_bounds_hold(u: float) -> None:
    cut = read_distribution({"normal": 0.0, "sigma": 1.0, "low": -0.3, "high": 0.2}, "here")
    assert -0.3 <= float(cut.quantile(u)) <= 0.2
    flat = read_distribution({"uniform": [0.1, 0.3]}, "here")
    assert 0.1 <= float(flat.quantile(u)) <= 0.3
    log = read_distribution({"log_uniform": [0.1, 0.3]}, "here")
    assert 0.1 <= float(log.quantile(u)) <= 0.3


@given(
    st.floats(-5.0, 5.0),
    st.floats(0.1, 3.0),
    st.none() | st.floats(-2.0, 0.0),
    st.none() | st.floats(0.5, 2.0),
    st.floats(-2.0, 0.4),
    st.floats(0.001, 0.999),
)
def test_what_must_stay_above_a_number_is_truncated_there_too(
    mean: float, sigma: float, low: float | None, high: float | None, least: float, u: float
) -> None:
    """Bounds in sigmas from the mean; the greater of the two lower ones counts."""
    told = {"normal": mean, "sigma": sigma}
    bounds = {"low": low, "high": high}
    told |= {name: mean + sigma * bound for name, bound in bounds.items() if bound is not None}
    cut = read_distribution(told, "here").at_least(mean + sigma * least)
    ends = max(least, -np.inf if low is None else low), np.inf if high is None else high
    expected = stats.truncnorm(*ends, mean, sigma).ppf(u)
    assert cut.quantile(u) == pytest.approx(expected, rel=1e-7, abs=1e-7 * sigma)


def test_choices_have_their_weights_and_their_types() -> None:
    def drawn(values: list[Any]) -> list[Any]:
        choice = read_distribution({"choice": values, "weights": [1, 2, 0, 1]}, "here")
        return [choice.quantile((number + 0.5) / 400.0) for number in range(400)]

    texts, numbers = drawn(["a", "b", "c", True]), drawn([1.5, 2, 2.5, 4])
    assert [texts.count(value) for value in ("a", "b", "c", True)] == [100, 200, 0, 100]
    assert [numbers.count(value) for value in (1.5, 2, 2.5, 4)] == [100, 200, 0, 100]
    assert type(texts[-1]) is bool
    assert type(numbers[200]) is int
    assert read_distribution("coarse", "here").quantile(0.3) == "coarse"


def test_what_is_drawn_stands_for_the_nominal_value_or_beside_it() -> None:
    assert read_distribution({"uniform": [1, 2]}, "").on(10.0, 1.5) == 1.5
    assert read_distribution({"uniform": [1, 2], "relative": True}, "").on(10.0, 1.5) == 15.0
    assert read_distribution({"uniform": [1, 2], "offset": True}, "").on(10.0, 1.5) == 11.5


def test_keys_do_not_meet() -> None:
    numbers = {
        bits(seed, name, number) for seed in range(5) for name in "ab" for number in range(9)
    }
    assert len(numbers) == 90
    pairs = np.array([[uniform(1, "x", k), uniform(1, "y", k)] for k in range(4000)]).T
    assert abs(np.corrcoef(pairs)[0, 1]) < 0.06
    assert 0.0 < pairs.min() < pairs.max() < 1.0


def test_numbers_are_those_of_every_machine() -> None:
    """Golden: other numbers here are other campaigns for every seed that was ever used."""
    assert [bits(7, "robot.links[joint1].mass", k) for k in range(2)] == GOLDEN_BITS
    assert uniform(7, "x", 3).hex() == GOLDEN_UNIFORM
    normal = read_distribution({"normal": 1.0, "sigma": 0.05, "low": 0.9}, "here")
    assert float(normal.quantile(uniform(7, "x", 3))).hex() == GOLDEN_NORMAL
    assert noise_seed(7, 3) == GOLDEN_SEED
    assert permutation(7, "x", 8).tolist() == GOLDEN_PERMUTATION
