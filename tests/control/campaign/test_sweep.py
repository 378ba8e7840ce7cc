"""Sweeps: the same draws for all laws, in any number of processes; what they sum up."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from space_robot_control.campaign.sweep import Law, Sweep, sweep
from space_robot_control.campaign.sweep.run import Row
from space_robot_control.campaign.sweep.scenario import Draw
from space_robot_control.campaign.sweep.summary import (
    as_records,
    cells,
    drawn,
    figure,
    shown,
    summary_table,
)
from space_robot_control.cli.main import cli
from space_robot_control.flight.plan import Flight
from space_robot_msgs_py.errors import InputError

STC, CTC = Law("tde_stc", "default"), Law("ctc", "default")


def study(**options: Any) -> Sweep:
    given = {"laws": [STC, CTC], "sensors": ["ideal"], "common": {"duration": 0.2}, **options}
    return Sweep(**given)


def test_the_rows_do_not_depend_on_the_number_of_processes() -> None:
    plan = study(draws=2, spread=0.2, sensors=["ideal", "fine"])
    one, two = sweep(plan, jobs=1), sweep(plan, jobs=2)
    assert one == two
    assert [row.draw for row in one] == list(plan.flights())
    first, other, *_ = [row.metrics["attitude"] for row in one if row.draw.law == CTC]
    assert first != other


def test_a_base_that_nothing_turns_has_dashes_beside_one_that_is_held() -> None:
    found = cells(sweep(study(actuators=["ideal", "none"])))
    held, free = ([cell for cell in found if cell.actuators == name] for name in ("ideal", "none"))
    assert not [cell for cell in found if cell.failed]
    assert all("attitude" in cell.metrics for cell in held)
    for cell in free:
        assert not {"attitude", "ripple_base_torque"} & cell.metrics.keys()
        assert cell.metrics["joints_1_3"][1] > 0.0
    for some in (found, free):
        summary_table(some)
        figure(some).canvas.draw()


def test_all_laws_fly_the_same_robot_and_noise() -> None:
    plan = study(draws=3, spread=0.2, seed=5)
    seeds = [plan.plan(Draw(law, "fine", 2)).seed for law in (STC, CTC)]
    assert seeds == [7, 7]

    def masses(of: Sweep, number: int) -> list[float]:
        robot = of.robot(number)
        assert robot
        return robot.mass.tolist()

    assert masses(plan, 2) == masses(plan, 2) != masses(plan, 1)
    longer = study(draws=9, spread=0.2, seed=5)
    assert masses(longer, 2) == masses(plan, 2), "draws that are added change none"


def test_masses_are_off_within_the_spread_and_no_law_is_told() -> None:
    plan = study(spread=0.2)
    flight = Flight(plan.plan(Draw(STC, "ideal", 0)))
    nominal, flown = flight.controller_settings.robot, flight.robot
    assert nominal == "paper"
    factors = flown.mass / np.array([750.0, 20.0, 35.0, 20.0, 10.0, 20.0, 5.0])
    assert np.all((factors > 0.8) & (factors < 1.2))
    assert np.ptp(factors) > 0.05
    assert flight.mission_settings.waypoints_deg
    assert study().robot(0) is None, "no spread, no other robot"


def row(law: Law, index: int, attitude: float, failure: str = "") -> Row:
    metrics = {} if failure else {"attitude": attitude, "ripple_base_torque": 10 * attitude}
    return Row(Draw(law, "fine", index), failure, metrics)


def test_medians_and_spread_leave_failures_out_and_count_them() -> None:
    rows = [row(STC, i, float(i + 1)) for i in range(5)] + [row(CTC, 0, 0.0, "diverged")]
    good, bad = cells(rows)
    assert (good.flights, good.failed, bad.failed) == (5, 0, 1)
    assert good.metrics["attitude"] == pytest.approx((1.2, 3.0, 4.8))
    assert not bad.metrics
    record = as_records([good, bad])
    assert record[0]["metrics"]["ripple_base_torque"]["median"] == 30.0
    assert record[1]["metrics"] == {}
    texts = list(summary_table([good, bad]).texts(summary_table([good, bad]).groups[0]))
    assert [line[-1] for line in texts] == ["0 of 5", "1 of 1"]
    assert [axes.get_ylabel() for axes in figure([good, bad]).axes] == [
        "attitude error", "base ripple (N m)"
    ]  # fmt: skip
    assert not figure([bad]).axes


@pytest.mark.parametrize(
    ("joints", "forces", "told", "last"),
    [
        (
            ["joints_1_3", "joints_4_6"], ["torque_1_3", "torque_4_6"],
            [("joints 1-3", "rad"), ("joints 4-6", "rad"), ("base ripple", "N m"),
             ("> 25 Hz", "N m"), ("ripple 1-3", "N m"), ("ripple 4-6", "N m")],
            ["joints_4_6", "ripple_torque_4_6"],
        ),
        (
            ["joints_revolute", "joints_prismatic"], ["torque_revolute", "force_prismatic"],
            [("joints revolute", "rad"), ("joints prismatic", "m"), ("base ripple", "N m"),
             ("> 25 Hz", "N m"), ("ripple revolute", "N m"), ("ripple prismatic", "N")],
            ["joints_prismatic", "ripple_force_prismatic"],
        ),
    ],
)  # fmt: skip
def test_what_is_shown_is_what_the_robot_has(
    joints: list[str], forces: list[str], told: list[tuple[str, str]], last: list[str]
) -> None:
    errors, columns = ["attitude", *joints], ["base_torque", *forces]
    every = [f"{kind}_{name}" for kind in ("ripple", "fast_ripple") for name in columns]
    metrics = dict.fromkeys([*errors, *columns, *every], 1.0)
    found = cells([Row(Draw(STC, "ideal", 0), "", metrics)])
    assert [*shown(found).values()] == [("attitude", ""), *told]
    assert drawn(found) == ["attitude", "ripple_base_torque", *last]


def test_sets_of_actuators_are_flown_like_grades_of_sensors() -> None:
    plan = study(actuators=["ideal", "none"], sensors=["ideal", "white_l1"])
    rows = sweep(plan)
    assert [row.draw for row in rows] == list(plan.flights())
    assert [row.as_record()["actuators"] for row in rows] == ["ideal"] * 4 + ["none"] * 4
    found = cells(rows)
    assert ["attitude" in cell.metrics for cell in found] == [True] * 4 + [False] * 4
    table = summary_table(found)
    assert [column.name for column in table.columns[:3]] == ["sensors", "actuators", "law"]
    assert len(table.groups) == 4
    assert figure(found).axes[0].get_xticklabels()[3].get_text() == "white_l1, none"
    alone = summary_table(found[:2])
    assert [column.name for column in alone.columns[:2]] == ["sensors", "law"]


def test_a_bad_option_is_refused_before_anything_flies() -> None:
    with pytest.raises(InputError, match="nosuch"):
        sweep(study(sensors=["nosuch"]))
    with pytest.raises(InputError, match="pid"):
        sweep(study(laws=[Law("pid", "default")]))


def test_the_command_writes_tables_and_a_figure(tmp_path: Path) -> None:
    out = tmp_path / "study"
    arguments = ["sweep", "--law", "tde_stc", "--sensors", "ideal", "--sensors", "white_l1"]
    arguments += ["--duration", "0.2", "--out", str(out), "--json"]
    result = CliRunner().invoke(cli, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    found = json.loads(result.stdout)["cells"]
    assert [cell["sensors"] for cell in found] == ["ideal", "white_l1"]
    ripples = [cell["metrics"]["torque_4_6"]["median"] for cell in found]
    assert ripples[0] < ripples[1]
    rows = list(csv.DictReader((out / "table.csv").read_text().splitlines()))
    assert [line["sensors"] for line in rows] == ["ideal", "white_l1"]
    assert {path.name for path in out.iterdir()} == {
        "table.csv", "summary.md", "sweep.png", "sweep.svg",
    }  # fmt: skip
