"""A report's tables, page and JSON on made-up campaigns: whole, unfinished, failed, with a grid."""

from __future__ import annotations

import json
import re
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from campaign_tables import made_table
from command import Run
from pandas import DataFrame
from rich.console import Console

from space_robot.campaign.flown import Campaign
from space_robot.campaign.report import page as page_module
from space_robot.campaign.report.console import print_report
from space_robot.campaign.report.findings import Findings
from space_robot.campaign.report.page import render
from space_robot.campaign.report.record import record
from space_robot.campaign.report.subject import Subject
from space_robot.campaign.report.verdict_tables import command, verdict_table
from space_robot.campaign.study import Study
from space_robot_msgs_py.errors import InputError

REQUIRE = {"pointing": {"metric": "attitude_max", "from_s": 2, "below": 4e-5, "in": 0.9}}
UNIFORM = {"uniform": [0.8, 1.2], "relative": True}


def found(
    table: DataFrame, metrics: tuple[str, ...] = ("attitude_rms",), runs: int = 0, **changes: Any
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
    return Findings(
        Subject(Path("campaigns/a b"), Study.model_validate(study), 7, asked, table, grid), metrics
    )


def printed(findings: Findings, width: int = 100) -> str:
    console = Console(width=width, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    print_report(findings, console)
    return console.export_text()


@pytest.fixture(scope="module")
def page() -> str:
    return render(found(made_table(60), ()))


def test_the_page_has_every_section(page: str) -> None:
    for section in (
        "flown",
        "requirements",
        "laws",
        "bands",
        "distributions",
        "sensitivity",
        "worst",
    ):
        assert f'<h2 id="{section}">' in page
        assert f'href="#{section}"' in page
    assert page.count("<figure>") == 2 + 5 + 1  # bands, distributions, what drives it
    assert len(page) < 2_000_000


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where it is about the page's text: figures take seconds."""
    monkeypatch.setattr(page_module, "drawings", lambda findings: iter(()))


def test_every_command_flies_a_row_of_the_campaign() -> None:
    import shlex

    findings = found(made_table(50))
    words = shlex.split(record(findings)["worst"][0]["command"])
    assert words[:4] == ["space-robot", "campaign", "rerun", "campaigns/a b"]
    assert "--bag" in words
    assert "--trust" not in words
    assert "'campaigns/a b'" in command(findings.subject.folder, findings.subject.study, 3, "ctc")
    named = shlex.split(command(Path("a"), findings.subject.study, 3, "ctc=/my gains/x"))
    assert named[-1] == "flights/3_ctc__my gains_x"


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
    assert ("No flight came to its end" in text) == (failing > 1.0)
    assert "not met" in text
    assert "diverged" in printed(findings)


@pytest.mark.usefixtures("no_figures")
def test_an_unfinished_campaign_says_so() -> None:
    table = made_table(20, bands=False).iloc[:31]  # one law has a run more
    findings = found(table, runs=100)
    assert "31 of 300 flights have been flown" in findings.remarks[0]
    assert findings.remarks[0] in render(findings)
    fixed = found(table, runs=100, fixed_runs=True)
    assert "no verdicts before all are flown" in fixed.remarks[0]
    assert {v.word for v in fixed.verdicts} == {"undecided"}


@pytest.mark.parametrize("fixed", [False, True])
def test_the_table_says_how_often_verdicts_are_false(fixed: bool) -> None:
    """Three laws at 90 %: 0.3 in all; who may look at any time has a column more."""
    findings = found(made_table(60, bands=False), fixed_runs=fixed)
    table = verdict_table(findings)
    assert (
        findings.family_error == record(findings)["any_verdict_false_at_most"] == pytest.approx(0.3)
    )
    assert "any of these 3 with at most 0.3" in " ".join(table.notes)
    columns = [column.name for column in table.columns]
    assert ("more runs" in columns) != fixed
    assert all(len(row) == len(columns) for row in table.groups[0].rows)


def test_flights_that_were_killed_are_told_apart() -> None:
    table = made_table(20, failing=0.0)
    table.loc[3, ["outcome", "reason"]] = ["killed", "its process was killed"]
    assert "1 killed" in " ".join(found(table).remarks)


def test_a_grid_has_a_row_a_point() -> None:
    findings = found(
        made_table(80, grid=("fine", "coarse")),
        vary={"scenario.sensors": {"grid": ["fine", "coarse"]}, "robot.base.mass": UNIFORM},
    )
    text = printed(findings, width=120)
    for line in ("sensors", "fine", "coarse", "to fly"):
        assert re.search(rf"\b{line}\b", text)
    assert {c["point"] for c in record(findings)["leagues"]} == {
        "sensors = fine",
        "sensors = coarse",
    }
    assert "at every point of the grid" in render(findings)
    names = {i.variable for _, _, s in findings.sensitivities for i in s.influences}
    assert "scenario.sensors" not in names


def test_the_metrics_asked_for_are_shown_and_others_refused() -> None:
    findings = found(made_table(20), ("attitude_max",))
    assert [q.name for q in findings.metrics] == ["attitude_max"]
    with pytest.raises(InputError, match=r"unknown metric 'x': choose one of attitude_rms, "):
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
    from space_robot.campaign.report.bands import bands

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
