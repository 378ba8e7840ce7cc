"""A short soak on the real graph, and its report."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import psutil
import pytest
from flights import ros_environment
from random_flights import sample_flight

from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")
pytestmark = pytest.mark.ros

SEED, DURATION_S = 3, 0.5


@pytest.fixture(scope="module")
def bags(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("soak") / "bags"


@pytest.fixture(scope="module")
def report(bags: Path) -> dict[str, Any]:
    file = bags.with_name("soak.json")
    options = f"--minutes 0.12 --seed {SEED} --duration {DURATION_S} --bags {bags} --output {file}"
    soak = _soak(*options.split())
    output, errors = soak.communicate(timeout=150)
    report: dict[str, Any] = json.loads(file.read_text("utf-8"))
    assert soak.returncode == (0 if report["survived"] == report["flights"] else 1), errors
    assert f"soak, seed {SEED}" in output
    assert len([line for line in errors.splitlines() if ", case " in line]) == report["flights"]
    return report


def _soak(*options: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, Path(__file__).parent, *options],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=ros_environment(),
    )


def test_the_flights_are_those_of_the_seed(report: dict[str, Any]) -> None:
    assert report["seed"] == SEED
    for number, flown in enumerate(report["each"], start=1):
        plan = sample_flight(SEED, number, DURATION_S)
        assert flown["number"] == number
        for key in ("controller", "case", "swaps", "faults", "seed"):
            assert flown[key] == getattr(plan, key), key


def test_the_table_adds_up(report: dict[str, Any]) -> None:
    each = report["each"]
    assert report["flights"] == len(each) > 0
    assert report["survived"] == sum(not flown["wrong"] for flown in each)
    assert not report["interrupted"]
    assert report["faults"] == sum(len(flown["faults"]) for flown in each)
    assert report["faults"] == sum(report["faults_by_kind"].values())
    assert report["restarts"] == sum(flown["restarts"] for flown in each)
    assert report["messages_lost"] == sum(flown["lost"] for flown in each)
    for what in ("attitude", "joint"):
        for name, breaks in (("tracking", False), ("disturbed", True)):
            of = {
                flown["number"]: flown[f"{what}_error"]
                for flown in each
                if flown["breaks_tracking"] == breaks
            }
            largest = report["largest_error"][name][what]
            assert (largest is None) == (not of)
            if largest:
                assert largest["value"] == max(of.values()) == of[largest["flight"]]


def test_nodes_are_weighed(report: dict[str, Any]) -> None:
    for flown in report["each"]:
        assert set(flown["memory_mb"]) == {"plant", "controller", "mission", "recorder"}
        assert min(flown["memory_mb"].values()) > 10.0
        assert flown["own_memory_mb"] > 10.0


def test_no_process_is_left(report: dict[str, Any]) -> None:
    wrong = [line for flown in report["each"] for line in flown["wrong"]]
    assert not [line for line in wrong if line.startswith("left behind")]


def test_bags_are_kept_where_that_is_wanted(report: dict[str, Any], bags: Path) -> None:
    kept = [Path(flown["bag"]) for flown in report["each"]]
    assert sorted(kept) == sorted(bags.iterdir())
    assert read_flight(kept[0]).flight["faults"] == report["each"][0]["faults"]


def test_ctrl_c_ends_with_the_table(tmp_path: Path) -> None:
    file = tmp_path / "soak.json"
    soak = _soak("--duration", "1000", "--output", str(file))
    until = time.monotonic() + 60.0
    while len(nodes := psutil.Process(soak.pid).children(recursive=True)) < 4:
        assert time.monotonic() < until
        time.sleep(0.1)
    os.kill(soak.pid, signal.SIGINT)
    output, errors = soak.communicate(timeout=60)
    assert soak.returncode == 130, errors
    assert "interrupted" in output
    assert "Traceback" not in errors
    assert json.loads(file.read_text("utf-8"))["flights"] == 0
    assert not any(node.is_running() for node in nodes)
