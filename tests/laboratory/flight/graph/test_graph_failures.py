"""What happens when a flight does not go to its end: no hang, no process, a readable bag."""

from __future__ import annotations

import json
import os
import resource
import signal
import time
from contextlib import suppress
from pathlib import Path

import psutil
import pytest
from flights import forked_space_robot, space_robot_here
from forked import Forked

from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")


def _nodes(pid: int) -> dict[str, int]:
    """The pids of a flight's nodes by name."""
    nodes = {}
    for process in psutil.Process(pid).children(recursive=True):
        with suppress(psutil.Error):  # it has just ended
            name, _, suffix = process.cmdline()[0].rpartition("_")
            if suffix == "node":
                nodes[name] = process.pid
    return nodes


def _start(bag: Path, *options: str) -> tuple[Forked, dict[str, int]]:
    """A long flight in progress, and the pids of its nodes by name."""
    process = forked_space_robot("fly", "--bag", str(bag), *options)
    file = bag / f"{bag.name}_0.mcap"
    until = time.monotonic() + 90.0
    while time.monotonic() < until and process.poll() is None:
        if file.exists() and file.stat().st_size > 1_000_000:  # more than is sent in advance
            break
        time.sleep(0.05)
    assert process.poll() is None, process.communicate()[1]
    nodes = _nodes(process.pid)
    assert len(nodes) == 4
    return process, nodes


def _assert_gone(nodes: dict[str, int]) -> None:
    assert not any(psutil.pid_exists(pid) for pid in nodes.values())


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_interrupted_flight_leaves_a_closed_bag_and_no_process(
    tmp_path: Path, number: signal.Signals
) -> None:
    process, nodes = _start(tmp_path / "bag")
    process.send_signal(number)
    _, standard_error = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert "stopped at" in standard_error
    assert "Traceback" not in standard_error
    _assert_gone(nodes)
    log = read_flight(tmp_path / "bag")
    assert log.ticks > 0
    assert not any(log.lost.values())


@pytest.mark.parametrize("victim", ["controller", "plant"])
def test_dead_node_ends_the_flight_with_an_error(tmp_path: Path, victim: str) -> None:
    process, nodes = _start(tmp_path / "bag")
    os.kill(nodes[victim], signal.SIGKILL)
    _, standard_error = process.communicate(timeout=60)
    assert process.returncode == 1
    assert f"{victim} ended by signal 9" in standard_error
    _assert_gone(nodes)
    assert read_flight(tmp_path / "bag").ticks > 0


def test_recorder_without_room_costs_the_bag_and_the_exit_code(tmp_path: Path) -> None:
    """Not the flight: it is flown to its end."""
    bag = tmp_path / "bag"
    process, nodes = _start(bag, "--duration", "4", "--json")
    limit = (bag / f"{bag.name}_0.mcap").stat().st_size + 500_000
    resource.prlimit(nodes["recorder"], resource.RLIMIT_FSIZE, (limit, limit))
    output, standard_error = process.communicate(timeout=120)
    assert process.returncode == 1
    assert "could not be written to the end (File too large)" in standard_error
    assert "recorder_node: not recording" in standard_error
    report = json.loads(output)
    assert report["unfinished"]
    assert int(report["graph"]["nodes"]["plant_node"]["tick"]) == 8_000


def test_diverging_flight_says_so(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    result = space_robot_here("fly", "--controller", "ctc", "--gains", "printed", "--bag", str(bag))
    assert result.returncode == 1
    assert "diverged at tick 11" in result.stderr
    assert read_flight(bag).flight["gains"] == "printed"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["fly", "--controller", "pid"], "unknown controller 'pid': choose one of adrc, ctc"),
        (["fly", "--case", "5"], "unknown case '5': choose one of 1, 2, 3, 4-1, 4-2"),
        (["fly", "--gains", "best"], "unknown gain set 'best' of robot 'paper'"),
        (["fly", "--command-latency-ticks", "-1"], "command_latency_ticks: Input should be"),
        (["simulate", "--duration", "0"], "duration: Input should be greater than 0, got 0"),
        (["simulate", "--robot", "nowhere.yaml"], "nowhere.yaml: no such file"),
        (["analyze", "nowhere"], "nowhere: no such bag"),
        (["fly", "--bag", "/proc/no/bag"], "/proc/no/bag: no bag can be written there"),
        (["fly", "--bag", "."], ".: exists already; a bag is never overwritten"),
    ],
)
def test_bad_input_is_one_clear_line_and_exit_code_2(
    options: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    result = space_robot_here(*options)
    assert result.returncode == 2
    assert said in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())
