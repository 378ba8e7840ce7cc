"""A campaign stops where all shares are known, whatever the order in which its rows come."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import binomtest

from space_robot_control.campaign.flown.precision import CHECKED_EVERY, Precision
from space_robot_control.campaign.row.row import Row, Task
from space_robot_control.campaign.study import Study

RUNS = 4 * CHECKED_EVERY


def study(half_width: float) -> Study:
    return Study.model_validate({
        "laws": ["tde_stc", "ctc"],
        "require": {"p": {"metric": "attitude_max", "below": 1.0, "in": 0.9}},
        "until": {"half_width": half_width, "runs": RUNS},
    })  # fmt: skip


@settings(max_examples=20)
@given(
    st.lists(st.booleans(), min_size=2 * RUNS, max_size=2 * RUNS),
    st.sampled_from([0.05, 0.08, 0.12]),
    st.randoms(use_true_random=False),
)
def test_the_stop_is_the_first_look_at_which_all_are_narrow(
    met: list[bool], half_width: float, random: object
) -> None:
    rows = [
        Row(Task(run, law), "complete", require={"p": 0.5 if met[2 * run + k] else 1.5})
        for run in range(RUNS)
        for k, law in enumerate(("tde_stc", "ctc"))
    ]
    random.shuffle(rows)  # type: ignore[attr-defined]
    precision = Precision(study(half_width), RUNS)
    for row in rows:
        precision.add(row)
    expected = RUNS
    for runs in range(CHECKED_EVERY, RUNS + 1, CHECKED_EVERY):
        widths = []
        for k in (0, 1):
            found = binomtest(sum(met[k : 2 * runs : 2]), runs).proportion_ci(0.9)
            widths.append((found.high - found.low) / 2)
        if max(widths) <= half_width:
            expected = runs
            break
    assert precision.stop == expected


def test_a_flight_that_failed_meets_nothing() -> None:
    precision = Precision(study(0.04), RUNS)
    for run in range(CHECKED_EVERY):
        for law in ("tde_stc", "ctc"):
            precision.add(Row(Task(run, law), "diverged", require={"p": 0.5}))
    assert precision.stop == CHECKED_EVERY  # none of 50: as narrow as all of 50
