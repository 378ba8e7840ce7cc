"""The command doctor: JSON, exit code, nothing left behind."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest
from command import Run
from flights import COMMAND
from flights import space_robot as started

NAMES = (
    *("Python", "packages", "extra ros", "extra campaign", "extra view", "flights", "kernels"),
    *("processor", "memory", "disk", "wall clock", "ROS 2", "C compiler", "C for aarch64"),
    "browser",
)


def test_the_report_as_json(space_robot: Run) -> None:
    code, out, _ = space_robot("doctor", "--json")
    report = json.loads(out)
    assert report.keys() == {
        "can_fly_in_process",
        "can_fly_with_ros",
        "commit",
        "versions",
        "items",
    }
    assert (code, report["can_fly_in_process"]) == (0, True)
    (ros,) = [item["status"] for item in report["items"] if item["name"] == "ROS 2"]
    assert report["can_fly_with_ros"] is (ros != "missing")
    assert report["versions"].keys() >= {"python", "space_robot", "numba"}
    for item in report["items"]:
        assert item.keys() == {"name", "status", "text", "advice", "values"}
        assert item["status"] in {"ok", "warning", "missing"}
        assert item["text"]
        assert item["advice"] or item["status"] == "ok", item
    assert [name for name in NAMES if name not in {item["name"] for item in report["items"]}] == []
    clock = next(item["values"] for item in report["items"] if item["name"] == "wall clock")
    assert clock["ticks"] == 4000


def test_where_flights_cannot_run_it_says_why_and_ends_with_1(tmp_path: Path) -> None:
    """Numba is broken here; the text is for people."""
    (tmp_path / "numba.py").write_text("raise ImportError('compiled for another NumPy')")
    ended = started("doctor", python_path=tmp_path)
    assert ended.returncode == 1
    assert ended.stderr == ""
    lines = ended.stdout.splitlines()
    (line,) = [text for text in lines if " flights:" in text]
    assert line.startswith("missing")
    assert "ImportError: compiled for another NumPy" in line
    assert lines[-1] == "flights cannot run"


def test_no_process_is_left() -> None:
    """Of its own process group, none lives when the command has ended."""
    command = [*COMMAND, "doctor", "--json"]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, start_new_session=True)
    assert process.wait(timeout=60) == 0
    with pytest.raises(ProcessLookupError):
        os.killpg(process.pid, 0)
