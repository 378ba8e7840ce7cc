"""Sweeps: the same draws for all laws, in any number of processes; what they sum up."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from space_robot.campaign.row.fly import RowFlyer
from space_robot.campaign.row.row import Row, Task
from space_robot.campaign.study import Study
from space_robot.campaign.sweep import sweep, sweep_study
from space_robot.campaign.sweep.study import ACTUATORS, SENSORS
from space_robot.campaign.sweep.summary import (
    as_records,
    cells,
    drawn,
    figure,
    hardware_of,
    row_record,
    shown,
    summary_table,
)
from space_robot.cli.main import cli
from space_robot.flight.ending import COMPLETE, DIVERGED
from space_robot.flight.plan import Flight
from space_robot_msgs_py.errors import InputError

LAWS = ("tde_stc", "ctc")


def study(**options: Any) -> Study:
    given: dict[str, Any] = {"sensors": ["ideal"], "common": {"duration": 0.2}, **options}
    return sweep_study(LAWS, **given)


def flight(of: Study, run: int, law: str = "tde_stc", seed: int = 0) -> Flight:
    assert of.runs
    return RowFlyer.of(of, seed, of.runs).draws.scenario(run, law).check()


def test_the_rows_do_not_depend_on_the_number_of_processes() -> None:
    plan = study(draws=2, spread=0.2, sensors=["ideal", "fine"])
    one, two = sweep(plan, jobs=1), sweep(plan, jobs=2)
    assert [row.digest for row in one] == [row.digest for row in two]
    assert [row.task for row in one] == [Task(run, law) for run in range(4) for law in LAWS]
    assert [hardware_of(row)[0] for row in one] == ["ideal", "ideal", "fine", "fine"] * 2
    assert len({row.digest for row in one}) == len(one)


def test_a_base_that_nothing_turns_has_dashes_beside_one_that_is_held() -> None:
    found = cells(sweep(study(actuators=["ideal", "none"])))
    held, free = ([cell for cell in found if cell.actuators == name] for name in ("ideal", "none"))
    assert not [cell for cell in found if cell.failed]
    assert all("attitude_rms" in cell.metrics for cell in held)
    for cell in free:
        assert not {"attitude_rms", "ripple_base_torque"} & cell.metrics.keys()
        assert cell.metrics["joints_1_3_rms"][1] > 0.0
    for some in (found, free):
        summary_table(some)
        figure(some).canvas.draw()


def test_all_laws_and_grades_fly_the_same_robot_and_noise() -> None:
    plan = study(draws=3, spread=0.2, sensors=["fine", "tactical"])
    first, other, graded = flight(plan, 4), flight(plan, 4, "ctc"), flight(plan, 5)
    for one in (other, graded):
        assert one.plan.seed == first.plan.seed
        np.testing.assert_array_equal(one.robot.mass, first.robot.mass)
    assert flight(plan, 2).plan.seed != first.plan.seed
    assert np.any(flight(plan, 2).robot.mass != first.robot.mass)
    longer = study(draws=9, spread=0.2, sensors=["fine", "tactical"])
    np.testing.assert_array_equal(flight(longer, 4).robot.mass, first.robot.mass)


def test_masses_are_off_within_the_spread_and_no_law_is_told() -> None:
    flown = flight(study(spread=0.2), 0)
    assert flown.controller_settings.robot == "paper"
    nominal = flight(study(), 0).robot
    assert nominal.mass.tolist() == [750.0, 20.0, 35.0, 20.0, 10.0, 20.0, 5.0]
    for name in ("mass", "inertia"):
        of_flown, of_nominal = getattr(flown.robot, name), getattr(nominal, name)
        is_there = of_nominal != 0.0
        factors = of_flown[is_there] / of_nominal[is_there]
        assert np.all((factors > 0.8) & (factors < 1.2))
        assert np.ptp(factors) > 0.05


def row(law: str, run: int, attitude: float, outcome: str = COMPLETE) -> Row:
    metrics = {"attitude_rms": attitude, "ripple_base_torque": 10 * attitude}
    vary = {ACTUATORS: "ideal", SENSORS: "fine"}
    reason = "" if outcome == COMPLETE else outcome
    return Row(Task(run, law), outcome, reason, 1.0, vary, metrics if not reason else {})


def test_medians_and_spread_leave_failures_out_and_count_them() -> None:
    rows = [row("tde_stc", i, float(i + 1)) for i in range(5)] + [row("ctc", 0, 0.0, DIVERGED)]
    good, bad = cells(rows)
    assert (good.flights, good.failed, bad.failed) == (5, 0, 1)
    assert good.metrics["attitude_rms"] == pytest.approx((1.2, 3.0, 4.8))
    assert not bad.metrics
    record = as_records([good, bad])
    assert record[0]["metrics"]["ripple_base_torque"]["median"] == 30.0
    assert record[1]["metrics"] == {}
    texts = list(summary_table([good, bad]).texts(summary_table([good, bad]).groups[0]))
    assert [line[-1] for line in texts] == ["0 of 5", "1 of 1"]
    assert [axes.get_ylabel() for axes in figure([good, bad]).axes] == [
        "attitude, RMS",
        "ripple, base torque (N m)",
    ]
    assert not figure([bad]).axes
    assert row_record(rows[-1])["failure"] == DIVERGED
    assert row_record(rows[2])["attitude_rms"] == 3.0


@pytest.mark.parametrize(
    ("joints", "forces", "last"),
    [
        (
            ["joints_1_3", "joints_4_6"],
            ["torque_1_3", "torque_4_6"],
            ["joints_4_6_rms", "ripple_torque_4_6"],
        ),
        (
            ["joints_revolute", "joints_prismatic"],
            ["torque_revolute", "force_prismatic"],
            ["joints_prismatic_rms", "ripple_force_prismatic"],
        ),
    ],
)
def test_what_is_shown_is_what_the_robot_has(
    joints: list[str], forces: list[str], last: list[str]
) -> None:
    errors, columns = ["attitude", *joints], ["base_torque", *forces]
    ripple, fast = ([f"{kind}_{name}" for name in columns] for kind in ("ripple", "fast_ripple"))
    names = [f"{name}_{kind}" for kind in ("rms", "max") for name in (*errors, *columns)]
    one = row("tde_stc", 0, 0.0)
    one = Row(one.task, COMPLETE, vary=one.vary, metrics=dict.fromkeys(names + ripple + fast, 1.0))
    found = cells([one])
    rms = [f"{name}_rms" for name in errors]
    assert shown(found) == [*rms, ripple[0], fast[0], *ripple[1:]]
    assert drawn(found) == ["attitude_rms", "ripple_base_torque", *last]


def test_sets_of_actuators_are_flown_like_grades_of_sensors() -> None:
    rows = sweep(study(actuators=["ideal", "none"], sensors=["ideal", "white_l1"]))
    assert [row_record(row)["actuators"] for row in rows] == ["ideal"] * 4 + ["none"] * 4
    found = cells(rows)
    assert ["attitude_rms" in cell.metrics for cell in found] == [True] * 4 + [False] * 4
    table = summary_table(found)
    assert [column.name for column in table.columns[:3]] == ["sensors", "actuators", "law"]
    assert len(table.groups) == 4
    assert figure(found).axes[0].get_xticklabels()[3].get_text() == "white_l1, none"
    alone = summary_table(found[:2])
    assert [column.name for column in alone.columns[:2]] == ["sensors", "law"]


def test_a_bad_option_is_refused_before_anything_flies() -> None:
    with pytest.raises(InputError, match=r"scenario\.sensors.*nosuch"):
        sweep(study(sensors=["nosuch"]))
    with pytest.raises(InputError, match="law pid"):
        sweep(sweep_study(["pid"], ["ideal"]))


def test_the_command_says_why_flights_failed() -> None:
    arguments = ["sweep", "--law", "ctc", "--law", "tde_smc", "--sensors", "ideal"]
    arguments += ["--duration", "0.1", "--set", "plant.echo_scale=[3]"]
    result = CliRunner().invoke(cli, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    told = "1 of 2 flights failed, the first, run 0 under tde_smc: the flight diverged at tick 2"
    assert told in result.stderr


def test_the_command_writes_tables_and_a_figure(tmp_path: Path) -> None:
    out = tmp_path / "study"
    arguments = ["sweep", "--law", "tde_stc", "--sensors", "ideal", "--sensors", "white_l1"]
    arguments += ["--duration", "0.2", "--out", str(out), "--json"]
    result = CliRunner().invoke(cli, arguments, catch_exceptions=False)
    assert result.exit_code == 0
    found = json.loads(result.stdout)["cells"]
    assert [cell["sensors"] for cell in found] == ["ideal", "white_l1"]
    ripples = [cell["metrics"]["torque_4_6_rms"]["median"] for cell in found]
    assert ripples[0] < ripples[1]
    rows = list(csv.DictReader((out / "table.csv").read_text().splitlines()))
    assert [line["sensors"] for line in rows] == ["ideal", "white_l1"]
    assert {path.name for path in out.iterdir()} == {
        "table.csv",
        "summary.md",
        "sweep.png",
        "sweep.svg",
    }
