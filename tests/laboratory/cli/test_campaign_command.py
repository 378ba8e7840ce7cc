"""``campaign run`` and ``campaign rerun``: what they say, and their exit codes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from space_robot.campaign.flown import FlownCampaign
from space_robot.campaign.store.manifest import read_manifest
from space_robot.campaign.store.table import table_rows, write_table
from space_robot.cli.campaign import name_of
from space_robot.cli.main import cli
from space_robot.processes.pool import cluster
from space_robot_msgs_py.errors import InputError

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


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("run", "FILE", "--out", "x"), "my.yaml: runs: missing"),
        (("run", "nothing", "--out", "x"), "unknown campaign 'nothing': choose one of"),
        (
            ("run", "FILE", "--runs", "2", "--out", "x", "--scheduler", "tcp://127.0.0.1:9"),
            "scheduler 'tcp://127.0.0.1:9': ",
        ),
        (("rerun", "nowhere", "1"), "nowhere: not a campaign folder"),
    ],
)
def test_what_cannot_be_is_one_line_and_leaves_nothing(
    file: Path,
    arguments: tuple[str, ...],
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(cluster, "CONNECT_S", 0.5)
    given = [str(file) if word == "FILE" else word for word in arguments]
    error = CliRunner().invoke(cli, ["campaign", *given]).exception
    assert isinstance(error, InputError)
    assert said in str(error)
    assert "\n" not in str(error)
    assert not (tmp_path / "x").exists()


def test_ctrl_c_says_how_to_go_on(file: Path, tmp_path: Path) -> None:
    command = [
        sys.executable,
        "-m",
        "space_robot.cli.main",
        "campaign",
        "run",
        str(file),
        "--runs",
        "5000",
        "--out",
        str(tmp_path / "a"),
        "--workers",
        "1",
    ]
    process = subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    )
    journal = tmp_path / "a/journal.db-wal"
    while process.poll() is None and not (journal.exists() and journal.stat().st_size > 100_000):
        time.sleep(0.02)
    os.kill(process.pid, signal.SIGINT)
    stdout, stderr = process.communicate(timeout=60)
    assert process.returncode == 130
    assert not stdout
    assert f"of 5000 flights are kept in {tmp_path / 'a'}: the same line goes on" in stderr
    assert len(FlownCampaign.open(tmp_path / "a").table) > 3
