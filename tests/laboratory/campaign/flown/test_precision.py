"""A campaign stops where all shares are known, whatever the order in which its rows come."""

from __future__ import annotations

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from space_robot.campaign.flown.precision import CHECKED_EVERY, Precision
from space_robot.campaign.row.row import Row, Task
from space_robot.campaign.study import Study
from space_robot.campaign.verdicts.share_test import Sequential

LAWS, SENSORS = ("tde_stc", "ctc"), ("fine", "coarse", "ideal")
DRAWS = 3 * CHECKED_EVERY
BOUNDS = {"p": 1.0, "q": 2.0}


def study(half_width: float, points: int) -> Study:
    return Study.model_validate(
        {
            "laws": LAWS,
            "vary": {"scenario.sensors": {"grid": SENSORS[:points]}},
            "require": {
                name: {"metric": "attitude_max", "below": bound, "in": 0.9}
                for name, bound in BOUNDS.items()
            },
            "until": {"half_width": half_width, "runs": points * DRAWS},
        }
    )


@settings(max_examples=12, deadline=None)
@given(
    st.integers(1, 3),
    st.sampled_from([0.07, 0.1, 0.13]),
    st.integers(0, 2**32 - 1),
    st.lists(st.sampled_from([0.5, 0.9, 1.0]), min_size=6, max_size=6),
)
@example(3, 0.1, 0, [0.5, 0.5, 1.0, 1.0, 1.0, 1.0])
@example(3, 0.1, 0, [1.0, 1.0, 1.0, 0.5, 1.0, 1.0])
@example(3, 0.1, 0, [1.0, 1.0, 1.0, 1.0, 0.5, 1.0])
def test_the_stop_is_the_first_look_at_which_all_are_narrow_at_each_point(
    points: int, half_width: float, seed: int, rates: list[float]
) -> None:
    """In whole draws: every point and every law has flown as often."""
    runs, rng = points * DRAWS, np.random.default_rng(seed)
    frequency = np.resize(rates, (points, 2))
    met = rng.uniform(size=(DRAWS, points, 2)) < frequency
    values = np.where(met, 0.5, np.where(rng.uniform(size=met.shape) < 0.5, 1.5, 2.5))
    rows = [
        Row(Task(draw * points + point, law), "complete", require=dict.fromkeys(BOUNDS, value))
        for draw in range(DRAWS)
        for point in range(points)
        for law, value in zip(LAWS, values[draw, point].tolist(), strict=True)
    ]
    precision = Precision(study(half_width, points), runs, {"scenario.sensors": points})
    for index in rng.permutation(len(rows)).tolist():
        precision.add(rows[index])
    expected = runs
    for draws in range(CHECKED_EVERY, DRAWS + 1, CHECKED_EVERY):
        failures = [(values[:draws] >= bound).sum(axis=0) for bound in BOUNDS.values()]
        intervals = [Sequential(0.9, 0.9).interval(int(k), draws) for k in np.ravel(failures)]
        if max(interval.half_width for interval in intervals) <= half_width:
            expected = draws * points
            break
    assert precision.stop == expected
    assert precision.is_reached == (expected < runs) or expected == runs


def test_a_flight_that_failed_meets_nothing() -> None:
    precision = Precision(study(0.06, 1), DRAWS, {})
    for run in range(CHECKED_EVERY):
        for law in LAWS:
            precision.add(Row(Task(run, law), "diverged", require={"p": 0.5, "q": 0.5}))
    assert precision.stop == CHECKED_EVERY  # none of 50: as narrow as all of 50
