"""Verdicts on requirements: known counts, failures and NaN, limits on both sides."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from campaign_tables import made_table
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.campaign.study import Requirement, Study
from space_robot.campaign.verdicts.requirements import Verdict, family_error, verdict, verdicts
from space_robot.campaign.verdicts.share_test import FixedSample, Sequential, ShareTest


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


def test_one_look_at_767_runs_without_failure_meets_997_at_90() -> None:
    assert judge(demand_of(1.0), rows([0.5] * 767)).word == "met"
    found = judge(demand_of(1.0), rows([0.5] * 766))
    assert (found.word, found.needed_without_failure, found.projected_decision) == (
        "undecided",
        None,
        None,
    )
    assert judge(demand_of(1.0), rows([0.5] * 950 + [2.0] * 50)).word == "not met"


def test_whoever_may_look_at_any_time_needs_994() -> None:
    assert judge(demand_of(1.0), rows([0.5] * 994), Sequential).word == "met"
    found = judge(demand_of(1.0), rows([0.5] * 900), Sequential)
    assert (found.word, found.needed_without_failure) == ("undecided", 94)
    assert found.projected_decision == (994, True)


def test_a_fixed_sample_shows_nothing_before_it_is_complete() -> None:
    found = judge(demand_of(1.0), rows([0.5] * 5000), None)
    assert (found.word, found.limits, found.bound) == ("undecided", (0.0, 1.0), None)
    table = made_table(100, laws=("ctc", "tde_stc"), failing=0.0)
    require = {"pointing": {"metric": "attitude_max", "below": 1.0, "in": 0.9}}
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


def test_the_error_of_all_verdicts_is_the_sum_of_theirs() -> None:
    requirement = {"metric": "attitude_max", "below": 1e-4, "in": 0.9}
    study = Study.model_validate(
        {
            "laws": ["ctc"],
            "require": {"pointing": requirement, "other": {**requirement, "confidence": 0.99}},
        }
    )
    table = made_table(20).assign(**{"require.other": 1.0})
    found = verdicts(table, study, 20)
    assert len(found) == 6
    assert family_error(study, found) == pytest.approx(3 * 0.1 + 3 * 0.01)
    assert family_error(study, 10 * found) == 1.0


@pytest.mark.parametrize("value", [1.0, 2.0])
def test_what_is_not_below_the_limit_is_a_failure(value: float) -> None:
    assert judge(demand_of(1.0), rows([value])).failures == 1


@pytest.mark.parametrize("outcome", ["diverged", "killed", "out_of_time", "refused", "unanswered"])
def test_a_flight_that_did_not_end_is_a_failure_whatever_its_number(outcome: str) -> None:
    found = judge(demand_of(1.0), rows([0.5] * 9, failed=1, outcome=outcome))
    assert (found.failures, found.not_ended) == (1, 1)
    assert found.not_of_the_law == (outcome in ("killed", "out_of_time", "refused"))
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


def test_a_requirement_from_below_mirrors_one_from_above() -> None:
    demand = demand_of(above=3.0, share=0.95, confidence=0.95)
    found = judge(demand, rows([float(n) for n in range(1, 94)]))
    assert (found.failures, found.bound) == (3, 2.0)


def test_no_runs_decide_nothing() -> None:
    found = judge(demand_of(1.0), rows([]))
    assert (found.word, found.runs, found.needed_without_failure) == ("undecided", 0, None)
    assert judge(demand_of(1.0), rows([]), Sequential).needed_without_failure == 994
    assert found.limits == (0.0, 1.0)
    assert found.bound is None


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


def test_every_law_at_every_point_of_the_grid_has_its_verdict() -> None:
    table = made_table(120, grid=("fine", "coarse"))
    study = Study.model_validate(
        {
            "laws": ["ctc"],
            "vary": {"scenario.sensors": {"grid": ["fine", "coarse"]}},
            "require": {"pointing": {"metric": "attitude_max", "below": 1e-4, "in": 0.9}},
        }
    )
    found = verdicts(table, study, 120, ["scenario.sensors"])
    assert [(v.point, v.law) for v in found] == [
        (f"sensors = {point}", law)
        for point in ("fine", "coarse")
        for law in ("ctc", "tde_stc", "tde_tsmc=robust")
    ]
    assert {v.runs for v in found} == {60}
