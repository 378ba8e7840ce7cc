"""The medians that ``campaign run`` prints at its end."""

from __future__ import annotations

import pytest
from campaign_tables import made_table

from space_robot.campaign.report.league_tables import number
from space_robot.campaign.verdicts.league import league
from space_robot.cli.campaign_display import medians


@pytest.mark.parametrize("failing", [0.0, 0.2, 0.7])
def test_medians_are_those_of_the_report_however_many_flights_failed(failing: float) -> None:
    table = made_table(runs=60, failing=failing)
    shown = medians(table, {law: law for law in table["law"]}, 1)
    reported = {s.law: s for s in league(table, "metric.attitude_rms").standings}
    assert [column.name for column in shown.columns] == [
        "law",
        "complete",
        "attitude_rms",
        "ripple_base_torque",
    ]
    (group,) = shown.groups
    for law, complete, median, _ in group.rows:
        assert complete == f"{60 - reported[law].failures} of 60"
        assert median == number(reported[law].median.value)
    assert (failing > 0.5) == any(row[2] == "failed" for row in group.rows)
