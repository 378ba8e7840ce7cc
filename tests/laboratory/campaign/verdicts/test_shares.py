"""Clopper-Pearson intervals against the beta distribution."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import beta

from space_robot.campaign.verdicts.shares import share_interval, share_limits


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


def test_no_runs_know_nothing() -> None:
    assert share_interval(0, 0, 0.9) == (0.0, 1.0)
    assert share_interval(0, 0, 0.9).half_width == 0.5
