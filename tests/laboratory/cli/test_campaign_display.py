"""The medians that ``campaign run`` prints at its end."""

from __future__ import annotations

import numpy as np
import pytest
from campaign_tables import made_table

from space_robot.campaign.report.league_tables import number
from space_robot.campaign.report.quantities import chosen, of_metric, of_requirement
from space_robot.campaign.report.verdict_tables import demanded
from space_robot.campaign.study import Requirement
from space_robot.campaign.verdicts.league import league
from space_robot.cli.campaign_display import medians


def test_the_attitude_is_shown_in_degrees_where_it_was_measured_so() -> None:
    table = made_table(runs=60)
    table["metric.attitude_deg_rms"] = np.degrees(2.0 * table["metric.attitude_rms"])
    shown = medians(table, {law: law for law in table["law"]}, 1)
    assert [column.name for column in shown.columns][2:] == [
        "attitude_deg_rms",
        "ripple_base_torque",
    ]
    known = table[table["law"] == "ctc"]["metric.attitude_deg_rms"].dropna()
    assert float(shown.groups[0].rows[0][2]) == pytest.approx(known.median(), rel=0.05)
    quantities = chosen(table, {})
    assert [q.name for q in quantities] == [
        "attitude_deg_rms",
        "joints_1_3_rms",
        "ripple_base_torque",
    ]
    assert quantities[0].label == "attitude, RMS (deg)"
    assert of_metric("tilt_deg_max").heading == "tilt deg, largest"  # of somebody's own
    assert of_metric("half_cone_arcsec_jitter_rms").label == "half cone jitter, RMS (arcsec)"


def test_a_demand_on_the_vector_part_tells_its_angle() -> None:
    demand = {"metric": "attitude_max", "below": 1e-3, "in": 0.9}
    text = demanded(of_requirement("p", Requirement.model_validate(demand)))
    assert text.startswith("attitude, largest below 0.001 (an angle of 0.115 deg) in 90 %")


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
