"""Templates of ``space-robot new``: laws, sensors, metrics, missions that fly, and their tests."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from paths import ROOT

from space_robot.cli.main import cli
from space_robot.cli.new_files import LAW, METRIC, MISSION, SENSOR
from space_robot_msgs_py.errors import InputError

KINDS = {kind.name: kind for kind in (LAW, SENSOR, METRIC, MISSION)}


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def run(*arguments: str) -> Result:
    return CliRunner().invoke(cli, arguments)


def pytest_of(folder: Path) -> subprocess.CompletedProcess[str]:
    """Run the tests of a folder as their user would."""
    return subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", str(folder)],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("out", ["", "my pieces/deep"])
def test_the_printed_command_flies_the_file(kind: str, out: str, tmp_path: Path) -> None:
    result = run("new", kind, "mine_2", *(["--out", out] if out else []))
    assert result.exit_code == 0, result.exception
    files = sorted(path.name for path in (tmp_path / out).iterdir())
    assert files == sorted(name.replace("$name", "mine_2") for name in KINDS[kind].files.values())
    for command in result.stdout.splitlines():
        _, *words = shlex.split(command)
        short = ["--duration", "0.2"] if words[0] == "simulate" else []
        flown = run(*words, *short, "--json")
        assert flown.exit_code == 0, (flown.output, flown.exception)
    report = json.loads(flown.stdout)
    assert report["rms"]["mean_axis"]["joints_1_3"] < 1e-4
    if kind == "metric":
        assert 0.0 < report["own_metrics"]["mine_2"] < 0.01


def test_their_tests_pass(tmp_path: Path) -> None:
    for kind in KINDS:
        assert run("new", kind, f"my_{kind}").exit_code == 0
    result = pytest_of(tmp_path)
    assert result.returncode == 0, result.stdout
    assert "8 passed" in result.stdout


def test_a_mission_is_one_of_its_robot() -> None:
    for robot in ("seven_joint", "boom"):  # boom: with prismatic joints, at their limits
        result = run("new", "mission", f"of_{robot}", "--robot", robot)
        assert result.exit_code == 0, result.exception
        _, *words = shlex.split(result.stdout)
        assert words == ["simulate", "--robot", robot, "--mission", f"of_{robot}.yaml"]
        planned = run("plan", f"of_{robot}.yaml", "--robot", robot, "--json")
        assert planned.exit_code == 0, (planned.output, planned.exception)


@pytest.mark.parametrize(
    ("kind", "name", "why"),
    [
        ("law", "ctc", "ctc is the name of a shipped law"),
        ("law", "none", "none is the name of a shipped law"),
        ("sensor", "fine", "fine is the name of a shipped sensor"),
        ("mission", "paper", "paper is the name of a shipped mission"),
        ("metric", "attitude_rms", "attitude_rms is the name of a shipped metric"),
        ("metric", "numpy", "numpy is the name of a Python module, which numpy.py would hide"),
        ("law", "My-Law", "'My-Law' is no name of a law: lower-case letters, digits and _"),
        ("law", "class", "'class' is no name of a law"),
        ("law", "test_x", "'test_x' is no name of a law"),
        ("sensor", "../x", "'../x' is no name of a sensor"),
    ],
)
def test_a_name_that_is_taken_or_none_is_refused(
    kind: str, name: str, why: str, tmp_path: Path
) -> None:
    result = run("new", kind, name)
    assert isinstance(result.exception, InputError)
    assert why in str(result.exception)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("kind", KINDS)
def test_nothing_is_overwritten(kind: str, tmp_path: Path) -> None:
    there = tmp_path / "test_mine.py"
    there.write_text("mine", "utf-8")
    result = run("new", kind, "mine")
    assert isinstance(result.exception, InputError)
    assert "test_mine.py: exists already; it is not overwritten" in str(result.exception)
    assert [path.name for path in tmp_path.iterdir()] == ["test_mine.py"]
    assert there.read_text("utf-8") == "mine"


def test_a_robots_file_needs_no_word() -> None:
    for arguments in (["robot"], []):
        result = run("new", *arguments, "no_such.urdf")
        assert "no_such.urdf" in str(result.exception)
    assert "--repair" in run("new", "my.urdf", "--help").stdout
    text = run("new", "--help").stdout
    assert all(f"new {kind} " in text for kind in KINDS)
