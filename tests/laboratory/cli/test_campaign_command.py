"""``campaign run`` and ``campaign rerun``: what they say, and their exit codes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from campaign_tables import made_table
from click.testing import CliRunner

from space_robot.campaign.flown import FlownCampaign
from space_robot.campaign.report.league_tables import number
from space_robot.campaign.report.quantities import chosen, of_metric, of_requirement
from space_robot.campaign.report.verdict_tables import demanded
from space_robot.campaign.store.manifest import read_manifest
from space_robot.campaign.store.table import table_rows, write_table
from space_robot.campaign.study import Requirement
from space_robot.campaign.verdicts.league import league
from space_robot.cli.campaign import name_of
from space_robot.cli.campaign_display import medians
from space_robot.cli.main import cli

pytest.importorskip("pyarrow")

FILE = """
scenario: {duration: 0.1}
laws: [tde_stc]
vary: {"scenario.case": {choice: ["1", "3"]}}
require: {p: {metric: attitude_max, below: 1.0, in: 0.5}}
"""


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("campaigns") / "my.yaml"
    path.write_text(FILE)
    return path


def test_the_default_folder_is_named_by_the_file_or_by_its_folder() -> None:
    assert name_of(Path("first")) == name_of(Path("some/first.yaml")) == "first"
    assert name_of(Path("mine/campaign.yaml")) == "mine"


@pytest.fixture(scope="module")
def flown(file: Path) -> Path:
    folder = file.parent / "a"
    result = CliRunner().invoke(
        cli, ["campaign", "run", str(file), "--runs", "4", "--out", str(folder), "--workers", "0"]
    )
    assert result.exit_code == 0, result.output
    assert "4 of 4" in result.stdout
    assert "met" in result.stdout
    assert f"campaign rerun {folder} " in result.stdout.replace("\n", " ")
    return folder


def test_the_same_line_again_says_that_there_is_nothing_to_fly(file: Path, flown: Path) -> None:
    result = CliRunner().invoke(
        cli, ["campaign", "run", str(file), "--runs", "4", "--out", str(flown), "--json"]
    )
    assert "all 4 flights are there: nothing to fly" in result.stderr
    report = json.loads(result.stdout)
    assert report["outcomes"] == {"tde_stc": {"complete": 4}}
    assert report["kept"] == 4
    assert report["verdicts"][0]["requirement"] == "p"


def test_more_runs_go_on(file: Path, flown: Path) -> None:
    result = CliRunner().invoke(
        cli, ["campaign", "run", str(file), "--runs", "6", "--out", str(flown), "--workers", "0"]
    )
    assert "4 of 6 flights are there; going on" in result.stderr
    assert len(FlownCampaign.open(flown).table) == 6


def test_rerun_says_that_the_digest_is_the_same_or_fails(flown: Path, tmp_path: Path) -> None:
    again = CliRunner().invoke(
        cli, ["campaign", "rerun", str(flown), "2", "--bag", str(tmp_path / "bag"), "--json"]
    )
    assert again.exit_code == 0, again.output
    assert json.loads(again.stdout)["campaign"]["same"]
    assert (tmp_path / "bag/metadata.yaml").is_file()
    other = flown.parent / "other"
    other.mkdir()
    manifest = read_manifest(flown / "campaign.json")
    rows = table_rows(flown / "table.parquet", manifest.table)
    software = {**manifest.software, "numpy": "0.1"}
    manifest = manifest.model_copy(update={"seed": manifest.seed + 1, "software": software})
    manifest.write(other / "campaign.json")
    write_table(other / "table.parquet", manifest.table, manifest.campaign, rows)
    found = [
        CliRunner().invoke(cli, ["campaign", "rerun", str(other), str(run)]) for run in range(4)
    ]
    differing = [result for result in found if result.exit_code == 1]
    assert differing
    assert "differs from the row's" in differing[0].stderr
    assert "numpy 0.1, now" in differing[0].stderr


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_who_ends_it_is_told_how_to_go_on(
    file: Path, tmp_path: Path, number: signal.Signals
) -> None:
    command = [sys.executable, "-m", "space_robot.cli.main", "campaign", "run", str(file)]
    command += ["--runs", "5000", "--out", str(tmp_path / "a"), "--workers", "1"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    journal = tmp_path / "a/journal.db-wal"
    while process.poll() is None and not (journal.exists() and journal.stat().st_size > 100_000):
        time.sleep(0.02)
    os.killpg(process.pid, number)  # as the terminal does
    stdout, stderr = process.communicate(timeout=120)
    assert process.returncode == 128 + number
    assert stderr.splitlines()[-1] == f"space-robot: stopped by {number.name}"
    assert "Traceback" not in stderr
    assert not stdout
    assert f"of 5000 flights are kept in {tmp_path / 'a'}: the same line goes on" in stderr
    assert len(FlownCampaign.open(tmp_path / "a").table) > 3


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
