"""The recorder in a real graph: killed, without room, without its folder. The flight goes on."""

from __future__ import annotations

import errno
import json
import os
import re
import resource
import shutil
import signal
import time
from pathlib import Path
from typing import Any

import pytest
from flights import Start, space_robot_here
from forked import Forked

from space_robot.flight.graph.listeners import wait_for
from space_robot.flight.graph.monitor import Monitor
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")

RECORDER = "recorder_node"
REPORTS_IN_FLIGHT = 3
PERIOD_S = 0.002
TIMEOUT_S = 60.0
REFERENCE, IN_FLIGHT = 20_000, 1_000_000
"""Bytes of a bag with some of the reference, and with more than what is sent in advance."""


def _start_graph(
    start: Start, bag: Path, ticks: int, realtime: bool = False, **common: Any
) -> dict[str, Forked]:
    """A flight begun when the recorder has what mission sends in advance."""
    flight = json.dumps(json.dumps({"realtime": realtime}))  # as text in YAML
    nodes = {
        "recorder": start("recorder", bag=bag, flight=flight, **common),
        "mission": start("mission", **common),
    }
    _wait_for_size(bag / f"{bag.name}_0.mcap", REFERENCE)
    nodes["controller"] = start("controller", wait_for=wait_for("controller"), **common)
    others = wait_for("plant")
    nodes["plant"] = start("plant", ticks=ticks, wait_for=others, realtime=realtime, **common)
    return nodes


def _wait_for_size(file: Path, size: int) -> None:
    until = time.monotonic() + TIMEOUT_S
    while not (file.exists() and file.stat().st_size > size):
        assert time.monotonic() < until
        time.sleep(0.02)


def _end(process: Forked) -> str:
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=30)
    return output


def _only_error_line(output: str) -> str:
    (line,) = [line for line in output.splitlines() if "error" in line]
    assert "Traceback" not in output
    return line


def test_killed_recorder_has_kept_all_but_the_last_moment(
    start: Start, domain: int, tmp_path: Path
) -> None:
    """What had come at one of its reports is in the file for good before the next one is heard.

    That lies a second later by the recorder's own clock, however busy the machine is.
    """
    bag = tmp_path / "bag"
    nodes = _start_graph(start, bag, ticks=200_000, realtime=True, period=PERIOD_S)
    monitor = Monitor(domain)
    received: list[int] = []
    heard_at, until = 0.0, time.monotonic() + TIMEOUT_S
    try:
        while len(received) < REPORTS_IN_FLIGHT:
            monitor.poll()
            if monitor.has_begun and monitor.heard_at.get(RECORDER, 0.0) > heard_at:
                heard_at = monitor.heard_at[RECORDER]
                received.append(int(monitor.values[RECORDER]["received"]))
            assert time.monotonic() < until
            time.sleep(0.01)
        nodes["recorder"].kill()
    finally:
        monitor.close()
    assert nodes["plant"].poll() is None
    assert received[0] < received[-2] <= sum(open_bag(bag).counts().values())
    log = read_flight(bag)
    assert log.ticks > 1
    assert not any(log.lost.values())
    result = space_robot_here("analyze", str(bag), "--json")
    assert json.loads(result.stdout)["unfinished"] == log.unfinished
    assert f"read up to t = {(log.ticks - 1) * PERIOD_S:.4f} s" in log.unfinished


def test_recorder_without_room_lets_the_flight_go_on(start: Start, tmp_path: Path) -> None:
    bag, ticks = tmp_path / "bag", 8_000
    nodes = _start_graph(start, bag, ticks)
    _wait_for_size(bag / "bag_0.mcap", IN_FLIGHT)
    limit = (bag / "bag_0.mcap").stat().st_size + 500_000
    resource.prlimit(nodes["recorder"].pid, resource.RLIMIT_FSIZE, (limit, limit))
    output, _ = nodes["plant"].communicate(timeout=120)
    assert nodes["plant"].returncode == 0, output
    output = _end(nodes["recorder"])
    assert nodes["recorder"].returncode == 1
    assert output.count("no longer written") == 1
    line = _only_error_line(output)
    assert str(bag) in line
    assert os.strerror(errno.EFBIG) in line
    kept = re.search(r"last tick kept: tick (\d+) ", line)
    assert kept
    log = read_flight(bag)
    assert 0 < log.ticks - 1 == int(kept[1]) < ticks - 1
    assert log.unfinished


def test_recorder_without_its_folder_says_so_at_once(start: Start, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    nodes = _start_graph(start, bag, ticks=8_000)
    _wait_for_size(bag / "bag_0.mcap", IN_FLIGHT)
    shutil.rmtree(bag)
    removed = time.time()
    output, _ = nodes["plant"].communicate(timeout=120)
    assert nodes["plant"].returncode == 0, output
    output = _end(nodes["recorder"])
    assert nodes["recorder"].returncode == 1
    said = re.search(r"\[(\d+\.\d+)\] \[recorder_node\]: the bag is no longer written", output)
    assert said
    assert float(said[1]) - removed < 2.0
    assert "removed or moved" in _only_error_line(output)
    assert not bag.exists()
