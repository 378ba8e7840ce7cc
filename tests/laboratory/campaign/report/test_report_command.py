"""``space-robot campaign report`` on a campaign that was flown: whole, killed, refused."""

from __future__ import annotations

import json
import re
from functools import partial
from pathlib import Path

import pytest
from command import Run

from space_robot.campaign.flown import Campaign


@pytest.fixture
def report(space_robot: Run) -> Run:
    return partial(space_robot, "campaign", "report")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file, out = (tmp_path_factory.mktemp("campaign") / name for name in ("my.yaml", "flown"))
    file.write_text(
        "scenario: {case: '1', duration: 0.05}\nlaws: [ctc, tde_stc]\n"
        "vary: {robot.base.mass: {uniform: [0.8, 1.2], relative: true}}\n"
        "require: {pointing: {metric: attitude_max, below: 1.0e-3, in: 0.9}}\n",
        "utf-8",
    )
    Campaign.load(file).run(6, 3, out, workers=0)
    return out


def test_it_prints_and_writes(folder: Path, tmp_path: Path, report: Run) -> None:
    html, markdown = tmp_path / "a.html", tmp_path / "a.md"
    code, out, err = report(
        str(folder), "--html", str(html), "--markdown", str(markdown), "--metric", "attitude_rms"
    )
    assert code == 0, err
    assert "pointing: attitude, largest below 0.001" in out
    assert "undecided" in out
    assert html.read_text("utf-8").startswith("<!doctype html>")
    assert "| tde_stc |" in markdown.read_text("utf-8")
    assert (tmp_path / "a.png").is_file()
    assert report(str(folder), "--html", str(html))[0] == 2


def test_a_campaign_that_was_killed_has_a_report(folder: Path, report: Run) -> None:
    """Its rows are in the journal only; the table comes back to the byte."""
    table = folder / "table.parquet"
    before = table.read_bytes()
    table.unlink()
    code, out, err = report(str(folder), "--json")
    assert code == 0, err
    content = json.loads(out)
    assert (content["rows"], content["laws"]) == (12, ["ctc", "tde_stc"])
    assert table.read_bytes() == before


def test_bad_input_is_one_line(folder: Path, tmp_path: Path, report: Run) -> None:
    for arguments, text in (
        ([str(tmp_path)], "not a campaign folder"),
        ([str(folder), "--metric", "x"], "unknown metric 'x': choose one of attitude_rms"),
    ):
        code, out, err = report(*arguments)
        assert (code, out) == (2, "")
        assert re.fullmatch(r"space-robot: error: [^\n]+\n", err), err
        assert text in err
