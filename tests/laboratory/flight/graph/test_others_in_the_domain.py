"""``fly`` where others are: one flight in a domain, one to a bag, the others refused in a line."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from flights import forked_space_robot, ros_environment, space_robot_here

from space_robot.analysis import analyze
from space_robot.flight.bag_path import check_bag_path
from space_robot.flight.graph import orchestrator
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.processes.node_modules import MODULES
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.ros.locks import nodes_in

pytest.importorskip("rclpy")

FOREIGN = """
import sys
import rclpy
from sensor_msgs.msg import JointState
rclpy.init()
node = rclpy.create_node("foreign")
node.create_publisher(JointState, sys.argv[1], 10)
print("ready", flush=True)
sys.stdin.read()
"""


@contextmanager
def process(domain: int, *command: str) -> Iterator[subprocess.Popen[str]]:
    """A process of others in a domain, until the context ends."""
    with subprocess.Popen(
        [sys.executable, *command],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        env={**ros_environment(), "ROS_DOMAIN_ID": str(domain)},
    ) as it:
        try:
            yield it
        finally:
            it.kill()


def refused(domain: int, bag: Path) -> str:
    """Why a flight there is refused; nothing is left of it."""
    result = space_robot_here(
        "fly", "--duration", "0.2", "--domain", str(domain), "--bag", str(bag)
    )
    assert result.returncode == 2, result.stderr
    assert "what was flown" not in result.stderr
    assert not bag.exists()
    return result.stderr


def test_of_two_at_the_same_moment_one_flies(tmp_path: Path, free_domain: int) -> None:
    bags = [tmp_path / "one", tmp_path / "two"]
    flights = [
        forked_space_robot(
            "fly", "--duration", "0.2", "--domain", str(free_domain), "--bag", str(bag)
        )
        for bag in bags
    ]
    words = [flight.communicate(timeout=150)[1] for flight in flights]
    codes = [flight.returncode for flight in flights]
    assert sorted(codes) == [0, 2], words
    flown = codes.index(0)
    log = read_flight(bags[flown])
    assert log.ticks == 400
    assert not any(log.lost.values())
    (line,) = words[1 - flown].splitlines()
    pid = flights[flown].pid
    assert f"ROS domain {free_domain} is taken by space-robot (pid {pid})" in line
    assert not bags[1 - flown].exists()


def test_beside_a_node_started_by_hand(tmp_path: Path, free_domain: int) -> None:
    with process(free_domain, "-m", MODULES["mission"]) as node:
        until = time.monotonic() + 60.0
        while not nodes_in(free_domain):
            assert time.monotonic() < until
            time.sleep(0.05)
        (line,) = refused(free_domain, tmp_path / "bag").splitlines()
        assert f"ROS domain {free_domain} is taken by mission_node (pid {node.pid})" in line


def test_a_foreign_publisher_that_was_there_before(tmp_path: Path, free_domain: int) -> None:
    with process(free_domain, "-c", FOREIGN, "/command") as foreign:
        assert foreign.stdout
        assert foreign.stdout.readline() == "ready\n"
        words = refused(free_domain, tmp_path / "bag")
    assert "/command is also published by /foreign" in words


def test_a_bag_that_another_flight_was_quicker_to_make_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It came between the look and the making; nothing of it is in its file yet."""
    bag = tmp_path / "bag"
    other = bag / "bag_0.mcap"

    def look(path: Path) -> None:
        check_bag_path(path)
        bag.mkdir()
        other.touch()
        monkeypatch.undo()

    monkeypatch.setattr(orchestrator, "check_bag_path", look)
    with pytest.raises(InputError, match="exists already"):
        orchestrator.fly(Flight(resolve(FlightPlan(duration=0.2))), bag, analyze)
    assert other.exists()
