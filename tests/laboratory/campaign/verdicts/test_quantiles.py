"""Quantiles and their intervals: coverage by simulation, ranks by the binomial distribution."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot.campaign.verdicts.quantiles import quantile


@pytest.mark.parametrize("share", [0.05, 0.5, 0.99])
@pytest.mark.parametrize("confidence", [0.9, 0.95])
def test_intervals_cover_the_quantile_as_often_as_said(share: float, confidence: float) -> None:
    """Of uniform numbers the quantile is the share; 800 campaigns of 500 runs."""
    drawn = np.random.default_rng(11).uniform(size=(800, 500))
    found = [quantile(values, share, confidence) for values in drawn]
    covered = np.mean([low <= share <= high for _, low, high in found])
    assert covered >= confidence - 3 * np.sqrt(confidence * (1.0 - confidence) / 800)
    assert np.mean([estimate.value for estimate in found]) == pytest.approx(share, abs=0.01)


def test_a_known_interval_of_a_median() -> None:
    """Of ten numbers the 2nd to the 9th hold the median at 97.9 %: the shortest for 95 %."""
    assert quantile(np.arange(1.0, 11.0), 0.5, 0.95)[1:] == (2.0, 9.0)


def test_too_few_numbers_leave_the_interval_open() -> None:
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


@given(st.lists(st.floats(1e-9, 1e9), min_size=1), st.floats(0.01, 0.99))
def test_it_does_not_depend_on_the_scale(values: list[float], share: float) -> None:
    plain = quantile(np.array(values), share)
    logarithm = quantile(np.log(values), share)
    assert np.log(plain.value) == pytest.approx(logarithm.value)
