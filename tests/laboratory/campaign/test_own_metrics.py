"""A campaign's own metrics: the same bits in every process, columns, requirements, and mistakes."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from space_robot import Campaign, FlownCampaign
from space_robot.campaign.report.findings import Findings
from space_robot.campaign.row import fly
from space_robot_control.laws.names import NotTrustedError
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.errors import InputError

pytest.importorskip("pyarrow")

FILE = """
import numpy as np

from space_robot.analysis.described import flown_robot


def overshoot(log):
    return np.abs(log.joint_positions - log.reference_joints[:, 0]).max()


def heavy_fails(log):
    if flown_robot(log).mass[0] > 760.0:
        raise ValueError("too heavy")
    return 1.0


def heavy_is_nan(log):
    return float("nan") if flown_robot(log).mass[0] > 760.0 else 1.0


def nan(log):
    return float("nan")
"""

CONTENT: dict[str, Any] = {
    "scenario": {"case": "3", "sensors": "fine", "duration": 0.2},
    "laws": ["tde_stc", "ctc=tuned"],
    "metrics": {"overshoot": "mine.py:overshoot"},
    "vary": {"robot.base.mass": {"normal": 1.0, "sigma": 0.05, "relative": True}},
    "require": {
        "small": {"metric": "overshoot", "below": 1e-3, "in": 0.9},
        "late": {"metric": "overshoot", "from_s": 0.1, "to_s": 0.15, "below": 1e-3, "in": 0.9},
        "pointing": {"metric": "attitude.max", "below": 1e-3, "in": 0.9},
    },
}


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("mine.py").write_text(FILE, "utf-8")


def overshoot(log: FlightLog) -> float:
    return float(np.abs(log.joint_positions - log.reference_joints[:, 0]).max())


def campaign(**other: Any) -> Campaign:
    return Campaign.of({**CONTENT, **other})


def digests(flown: FlownCampaign) -> list[str]:
    return list(flown.table["digest"])


def test_it_is_a_column_with_the_same_bits_however_it_is_flown(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    one = campaign().run(6, 7, "one", workers=0)
    two = campaign().run(6, 7, "two", workers=2)
    assert digests(one) == digests(two)
    assert one.table.equals(two.table)
    monkeypatch.setattr(fly, "batches", lambda flights: ([one] for one in flights))
    assert digests(campaign().run(6, 7, workers=0)) == digests(one)
    table = one.table
    for row in (3, 8):
        run, law = int(table["run"][row]), table["law"][row]
        again = one.rerun(run, law)
        assert again.is_same
        assert table["metric.overshoot"][row] == again.metric(overshoot)
        assert table["require.small"][row] == again.metric(overshoot)
        assert table["require.late"][row] == again.metric(lambda log: overshoot(log.rows(200, 301)))


def test_verdicts_and_reports_have_it() -> None:
    flown = campaign().run(5, 7, "one", workers=0)
    assert {verdict.requirement for verdict in flown.verdicts} == {"small", "late", "pointing"}
    names = [quantity.name for quantity in Findings.of(flown).metrics]
    assert "overshoot" in names
    assert read_yaml(Path("one/study.yaml"))["metrics"] == CONTENT["metrics"]
    assert not flown.study_changes
    assert "mine.py" in flown.manifest.files
    Path("mine.py").write_text(FILE.replace(".max()", ".min()"), "utf-8")
    with pytest.raises(InputError, match=r"was started with another named file: mine\.py"):
        campaign().run(8, 7, "one", workers=0)
    other = campaign(metrics={"overshoot": "mine.py:nan"}).study
    with pytest.raises(InputError, match=r"metrics\.overshoot: 'mine\.py:overshoot' was flown"):
        Findings.of(flown, other)


def test_code_of_someone_elses_folder_is_not_run() -> None:
    campaign().run(1, 7, "one", workers=0)
    flown = FlownCampaign.open("one")
    assert len(flown.table) == 2
    with pytest.raises(NotTrustedError, match="metrics of its own \\(overshoot\\): --trust"):
        flown.rerun(0)
    assert FlownCampaign.open("one", trust=True).rerun(0).is_same


def test_a_function_of_this_session_is_flown_in_this_process() -> None:
    """Such as a notebook's; of a module that others can import, in all processes."""
    calls: list[int] = []

    def counted(log: FlightLog) -> float:
        calls.append(log.ticks)
        return float(len(log.time))

    own = Campaign.of({**CONTENT, "metrics": {}, "require": {}}, {"counted": counted})
    said: list[str] = []
    table = own.run(3, 7, warn=said.append).table
    assert list(table["metric.counted"]) == [400.0] * 6
    assert len(calls) == 7, "the nominal flight, and six"
    assert "metrics counted: of this Python session" in said[0]
    assert own.run(3, 7, workers=0, warn=said.append).rerun(1).is_same
    for options in ({"workers": 2}, {"out": "one"}, {"scheduler": "tcp://x:1"}):
        with pytest.raises(InputError, match=r"put them into a file, mine\.py, and name them as"):
            own.run(3, 7, **options)  # type: ignore[arg-type]


def test_a_function_that_fails_in_a_run_is_that_runs_row() -> None:
    content: dict[str, Any] = {
        "laws": ["tde_stc"],
        "metrics": {"fails": "mine.py:heavy_fails", "is_nan": "mine.py:heavy_is_nan"},
        "require": {},
    }
    table = campaign(**content).run(8, 7, workers=0).table
    heavy = 750.0 * table["vary.robot.base.mass"] > 760.0
    assert 0 < heavy.sum() < len(table)
    assert set(table["outcome"][heavy]) == {"failed"}
    assert set(table["outcome"][~heavy]) == {"complete"}
    reason = "metric fails failed: ValueError: too heavy (mine.py, line 13)"
    assert set(table["reason"][heavy]) == {reason}
    content["metrics"] = {"is_nan": "mine.py:heavy_is_nan"}
    table = campaign(**content).run(8, 7, workers=0).table
    assert set(table["outcome"]) == {"complete"}
    np.testing.assert_array_equal(table["metric.is_nan"].isna(), heavy)
