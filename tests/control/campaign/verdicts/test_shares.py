"""Clopper-Pearson intervals against the beta distribution and known values."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import beta, binom

from space_robot_control.campaign.verdicts.shares import share_interval, share_limits


def test_the_rule_of_three() -> None:
    """No failure in n runs: at 95 % the share of failures is below 3/n."""
    low = share_limits(1000, 1000, 0.95).low
    assert 1.0 - low == pytest.approx(1.0 - 0.05 ** (1 / 1000), rel=1e-12)
    assert 1.0 - low == pytest.approx(3.0 / 1000, rel=0.01)


def test_a_published_interval() -> None:
    """10 of 100 at 95 %: 4.90 % to 17.62 % in the tables of Clopper and Pearson."""
    assert share_interval(10, 100, 0.95) == pytest.approx((0.0490, 0.1762), abs=5e-5)


@given(
    st.integers(1, 3000).flatmap(lambda n: st.tuples(st.integers(0, n), st.just(n))),
    st.floats(0.5, 0.999),
)
def test_both_ends_are_quantiles_of_beta(counts: tuple[int, int], confidence: float) -> None:
    k, n = counts
    tail = 0.5 * (1.0 - confidence)
    low = beta.ppf(tail, k, n - k + 1) if k else 0.0
    high = beta.ppf(1.0 - tail, k + 1, n - k) if k < n else 1.0
    assert share_interval(k, n, confidence) == pytest.approx((low, high), rel=1e-6, abs=1e-12)
    limits = share_limits(k, n, 1.0 - tail)
    assert limits == pytest.approx((low, high), rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("share", [0.5, 0.9, 0.997])
@pytest.mark.parametrize("n", [10, 300])
def test_the_share_is_covered_at_least_as_often_as_said(share: float, n: int) -> None:
    """Summed over all that can be seen, not sampled."""
    found = [share_interval(k, n, 0.9) for k in range(n + 1)]
    covered = np.array([low <= share <= high for low, high in found])
    assert binom.pmf(np.arange(n + 1), n, share)[covered].sum() >= 0.9


def test_no_runs_know_nothing() -> None:
    assert share_interval(0, 0, 0.9) == (0.0, 1.0)
    assert share_interval(0, 0, 0.9).half_width == 0.5
