"""A report's tables, page and JSON on made-up campaigns; what the campaign commands say."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaign_tables import made_table
from click.testing import CliRunner, Result
from pandas import DataFrame
from rich.console import Console

from space_robot.campaign.flown import FlownCampaign
from space_robot.campaign.flown.store import held_store
from space_robot.campaign.report import documents
from space_robot.campaign.report.documents import print_report, record, render
from space_robot.campaign.report.figures import bands
from space_robot.campaign.report.findings import Findings, Quantity
from space_robot.campaign.report.tables import demand_text, number, verdict_table
from space_robot.campaign.study import Requirement, Study
from space_robot.campaign.verdicts.laws import league
from space_robot.cli.campaign import campaign_name
from space_robot.cli.campaign_display import medians
from space_robot.cli.main import cli
from space_robot_msgs_py.errors import InputError

pytest.importorskip("pyarrow")

REQUIRE = {"pointing": {"metric": "attitude.max", "from_s": 2, "below": 4e-5, "in": 0.9}}
UNIFORM = {"uniform": [0.8, 1.2], "relative": True}


def found(
    table: DataFrame, metrics: tuple[str, ...] = ("attitude.rms",), runs: int = 0, **changes: Any
) -> Findings:
    study = {
        "scenario": {"case": "3"},
        "laws": list(table["law"].unique()),
        "require": REQUIRE,
        "vary": {"robot.base.mass": UNIFORM},
        **changes,
    }
    grid = [name for name, value in study["vary"].items() if "grid" in value]
    asked = runs or table["run"].nunique()
    folder, judged_by = Path("campaigns/a b"), Study.model_validate(study)
    return Findings(folder, judged_by, 7, asked, table, grid, compared=metrics)


def printed(findings: Findings, width: int = 100) -> str:
    console = Console(width=width, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    print_report(findings, console)
    return console.export_text()


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where it is about the page's text: figures take seconds."""
    monkeypatch.setattr(documents, "drawings", lambda findings: {})


def test_every_command_flies_a_row_of_the_campaign() -> None:
    findings = found(made_table(50))
    words = shlex.split(record(findings)["worst"][0]["command"])
    assert words[:4] == ["space-robot", "campaign", "rerun", "campaigns/a b"]
    assert ("--bag" in words, "--trust" in words) == (True, False)
    assert findings.rerun_command(8, "ctc").startswith("space-robot campaign rerun 'campaigns/a b'")
    named = shlex.split(findings.rerun_command(3, "mine.py:Law=/my gains/x"))
    assert named[-1] == "flights/3_mine.py_Law__my_gains_x"


def test_the_worst_are_failures_then_the_largest() -> None:
    table = made_table(100, failing=0.02)
    findings = found(table)
    worst = findings.worst(findings.whole, findings.required[0], count=30)
    outcomes = [o == "complete" for o in worst["outcome"]]
    assert outcomes == sorted(outcomes)
    values = worst["require.pointing"].dropna().tolist()
    assert values == sorted(values, reverse=True)
    complete = table[table["outcome"] == "complete"]
    assert values[0] == complete["require.pointing"].max()


@pytest.mark.parametrize("failing", [1.1, 0.5])
def test_a_campaign_of_failed_flights_gives_a_report(failing: float) -> None:
    findings = found(made_table(12, failing=failing, bands=failing > 1.0))
    text = render(findings)
    json.dumps(record(findings), default=str)
    assert ("No flight is complete" in text) == (failing > 1.0)
    assert "not met" in text
    assert "diverged" in printed(findings)


@pytest.mark.usefixtures("no_figures")
def test_an_unfinished_campaign_says_so() -> None:
    table = made_table(20, bands=False).iloc[:31].copy()  # one law has a run more
    table.loc[3, ["outcome", "reason"]] = ["killed", "its process was killed"]
    findings = found(table, runs=100)
    assert "31 of 300 flights have been flown" in findings.remarks[0]
    assert "1 killed: these flights count as failures" in findings.remarks[1]
    assert findings.remarks[0] in render(findings)
    fixed = found(table, runs=100, fixed_runs=True)
    assert "no verdicts before all are flown" in fixed.remarks[0]
    assert {v.word for v in fixed.verdicts} == {"undecided"}


@pytest.mark.parametrize("fixed", [False, True])
def test_the_table_says_how_often_verdicts_are_false(fixed: bool) -> None:
    """Three laws at 90 %: 0.3 in all; who may look at any time has a column more."""
    findings = found(made_table(60, bands=False), fixed_runs=fixed)
    table = verdict_table(findings, findings.required[0])
    assert record(findings)["any_verdict_false_at_most"] == pytest.approx(0.3)
    assert "any of these 3 with at most 0.3" in printed(findings)
    columns = [column.name for column in table.columns]
    assert ("more runs" in columns) != fixed
    assert all(len(row) == len(columns) for row in table.groups[0].rows)


def test_the_metrics_asked_for_are_shown_and_others_refused() -> None:
    findings = found(made_table(20), ("attitude.max",))
    assert [q.name for q in findings.metrics] == ["attitude.max"]
    with pytest.raises(InputError, match=r"unknown metric 'x': choose one of attitude.rms, "):
        found(made_table(20), ("x",))


@pytest.mark.usefixtures("no_figures")
def test_saltelli_has_indices_and_verdicts_of_independent_points() -> None:
    """Three variables: five runs a row, of which two points count."""
    findings = found(made_table(100, bands=False), design="saltelli")
    assert {v.runs for v in findings.verdicts} == {40}
    assert len(findings.sobol) == 3
    assert "Sobol indices" in render(findings)
    assert any("points A and B" in remark for remark in findings.remarks)


def test_bands_count_failed_flights_as_worse() -> None:
    rows = made_table(20, laws=("ctc",), failing=0.0)
    low, middle, high, largest = bands(rows, "attitude")
    values = np.array(rows["band.attitude"].tolist())
    np.testing.assert_allclose(middle, np.quantile(values, 0.5, axis=0, method="inverted_cdf"))
    np.testing.assert_allclose(largest, values.max(axis=0))
    rows["band.attitude"] = [v[:50] if i < 2 else v for i, v in enumerate(rows["band.attitude"])]
    broken = bands(rows, "attitude")
    assert np.isinf(broken[2][50:]).all()  # 10 % failed: the 95 % are worse than any number
    np.testing.assert_array_equal(broken[2][:50], high[:50])
    assert np.all(broken[0] >= low)


FILE = """
scenario: {duration: 0.1}
laws: [tde_stc]
vary: {"scenario.case": {choice: ["1", "3"]}}
require: {p: {metric: attitude.max, below: 1.0, in: 0.5}}
"""


def campaign(verb: str, *words: object) -> Result:
    return CliRunner().invoke(cli, ["campaign", verb, *map(str, words)])


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("campaigns") / "my.yaml"
    path.write_text(FILE)
    return path


def test_the_default_folder_is_named_by_the_file_or_by_its_folder() -> None:
    assert campaign_name(Path("first")) == campaign_name(Path("some/first.yaml")) == "first"
    assert campaign_name(Path("mine/campaign.yaml")) == "mine"


@pytest.fixture(scope="module")
def flown(file: Path) -> Path:
    folder = file.parent / "a"
    result = campaign("run", file, "--runs", 4, "--out", folder, "--workers", 0)
    assert result.exit_code == 0, result.output
    assert "4 of 4" in result.stdout
    assert "met" in result.stdout
    assert f"campaign rerun {folder} " in result.stdout.replace("\n", " ")
    return folder


def test_the_same_line_again_flies_nothing_and_more_runs_go_on(file: Path, flown: Path) -> None:
    result = campaign("run", file, "--runs", 4, "--out", flown, "--json")
    assert "all 4 flights are there: nothing to fly" in result.stderr
    report = json.loads(result.stdout)
    assert report["outcomes"] == {"tde_stc": {"complete": 4}}
    assert report["kept"] == 4
    assert report["verdicts"][0]["requirement"] == "p"
    assert isinstance(campaign("report", flown, "--html", file).exception, InputError)
    result = campaign("run", file, "--runs", 6, "--out", flown, "--workers", 0)
    assert "4 of 6 flights are there; going on" in result.stderr
    assert len(FlownCampaign.open(flown).table) == 6


def test_rerun_says_that_the_digest_is_the_same_or_fails(flown: Path, tmp_path: Path) -> None:
    again = campaign("rerun", flown, 2, "--bag", tmp_path / "bag", "--json")
    assert again.exit_code == 0, again.output
    assert json.loads(again.stdout)["campaign"]["same"]
    assert (tmp_path / "bag/metadata.yaml").is_file()
    other = Path(shutil.copytree(flown, tmp_path / "other"))
    manifest = FlownCampaign.open(flown).manifest
    software = {**manifest.software, "numpy": "0.1"}
    with held_store(other) as store:
        seed = manifest.seed + 1
        store.write_manifest(manifest.model_copy(update={"seed": seed, "software": software}))
    reruns = (campaign("rerun", other, run) for run in range(4))
    differing = next(result for result in reruns if result.exit_code == 1)
    assert "differs from the row's" in differing.stderr
    assert "numpy 0.1, now" in differing.stderr


def test_who_ends_it_is_told_how_to_go_on(file: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "space_robot.cli.main", "campaign", "run", str(file)]
    command += ["--runs", "5000", "--out", str(tmp_path / "a"), "--workers", "1"]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    log = tmp_path / "a/campaign.sqlite-wal"
    while process.poll() is None and not (log.exists() and log.stat().st_size > 100_000):
        time.sleep(0.02)
    os.killpg(process.pid, signal.SIGINT)  # as the terminal does
    stdout, stderr = process.communicate(timeout=120)
    assert process.returncode == 128 + signal.SIGINT
    assert stderr.splitlines()[-1] == "space-robot: stopped by SIGINT"
    assert "Traceback" not in stderr
    assert not stdout
    assert f"of 5000 flights are kept in {tmp_path / 'a'}: the same line goes on" in stderr
    assert len(FlownCampaign.open(tmp_path / "a").table) > 3


def test_the_attitude_is_shown_in_degrees_where_it_was_measured_so() -> None:
    table = made_table(runs=60)
    table["metric.attitude_angle.rms"] = np.degrees(2.0 * table["metric.attitude.rms"])
    assert found(table, ()).metrics[0].label == "attitude angle, RMS (deg)"
    assert Quantity.of("tilt_deg_max").heading == "tilt deg max"  # of somebody's own
    demand = {"metric": "attitude.max", "below": 1e-3, "in": 0.9}  # of the vector part
    text = demand_text(Quantity.of("attitude.max", "p", Requirement.model_validate(demand)))
    assert text.startswith("attitude, largest below 0.001 (an angle of 0.115 deg) in 90 %")


@pytest.mark.usefixtures("no_figures")
def test_what_flights_warn_of_is_in_the_first_lines() -> None:
    table = made_table(30, laws=("ctc", "tde_stc"), failing=0.0, bands=False)
    table["warnings"] = np.where(table["law"] == "ctc", "limit cycle; joints near", "")
    table.loc[table["law"].eq("ctc").idxmax(), "warnings"] = "joints near"
    findings = found(table)
    warned = ["ctc: joints near in 30 of 30, limit cycle in 29 of 30 flights"]
    assert findings.flight_warnings == record(findings)["warnings"] == warned
    lines = printed(findings).splitlines()
    assert lines[0] == "Findings"
    assert warned[0] in lines[1]
    assert warned[0] in render(findings)
    assert not found(made_table(30, bands=False)).flight_warnings


def test_a_list_of_equal_worst_runs_says_so() -> None:
    table = made_table(30, laws=("ctc",), failing=0.0, bands=False)
    assert "are equal" not in printed(found(table))
    table["require.pointing"] = np.minimum(table["require.pointing"], 1e-5)
    same = (table["require.pointing"] == 1e-5).sum()
    assert same > 10
    assert f"All 10 are equal, as {same} of 30 flights are: 1e-05" in printed(found(table))


@pytest.mark.parametrize("failing", [0.0, 0.2, 0.7])
def test_medians_are_those_of_the_report_however_many_flights_failed(failing: float) -> None:
    table = made_table(runs=60, failing=failing)
    shown = medians(table, {law: law for law in table["law"]}, 1)
    reported = {s.law: s for s in league(table, "metric.attitude.rms").standings}
    (group,) = shown.groups
    for law, complete, median, _ in group.rows:
        assert complete == f"{60 - reported[law].failures} of 60"
        assert median == number(reported[law].median.value)
    assert (failing > 0.5) == any(row[2] == "failed" for row in group.rows)
