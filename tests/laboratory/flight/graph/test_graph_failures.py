"""Flights that do not go to their end: no hang, no process, a readable bag, one clear line."""

from __future__ import annotations

import json
import os
import resource
import shutil
import signal
import time
from pathlib import Path
from typing import Any

import psutil
import pytest
from flights import PausedFlight, forked_space_robot, space_robot_here

from space_robot.flight.graph import simulation_calls
from space_robot.flight.graph.node_services import set_parameters
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import FlightError

pytest.importorskip("rclpy")

TIMEOUT_S = 90.0


class Begun(PausedFlight):
    """A flight that is paused after 100 ticks, and its nodes."""

    def __init__(self, bag: Path, domain: int, *options: str) -> None:
        super().__init__(bag, domain, *options)
        self.sim("step", "--ticks", "100")
        self.processes = self.nodes()
        assert len(self.processes) == (1 if "--composed" in options else 4)

    def end(self) -> tuple[int, str, str]:
        """No process is left, and no traceback is printed."""
        code, output, errors = super().end()
        assert "Traceback" not in errors
        assert not any(node.is_running() for node in self.processes.values())
        return code, output, errors

    def closed_bag(self) -> int:
        """The ticks in it: those of 0 to 100 have been measured and answered."""
        log = read_flight(self.bag)
        assert (log.unfinished, log.damage) == ("", ())
        assert not any(log.lost.values())
        return log.ticks


@pytest.mark.parametrize(
    ("number", "options"), [(signal.SIGINT, ()), (signal.SIGTERM, ("--composed",))]
)
def test_interrupted_flight_leaves_a_closed_bag_and_no_process(
    tmp_path: Path, free_domain: int, number: signal.Signals, options: tuple[str, ...]
) -> None:
    """In flight, and paused."""
    flight = Begun(tmp_path / "bag", free_domain, *options)
    if is_paused := bool(options):
        assert "already paused at tick 100" in flight.sim("pause")
    else:
        flight.sim("resume")
        assert "plant_node cannot step: it is not paused" in flight.sim("step", code=1)
    flight.process.send_signal(number)
    code, _, errors = flight.end()
    assert code == 128 + number
    assert "stopped at" in errors
    assert (flight.closed_bag() == 101) is is_paused


def test_a_dead_plant_ends_the_flight_with_an_error(tmp_path: Path, free_domain: int) -> None:
    flight = Begun(tmp_path / "bag", free_domain)
    flight.processes["plant"].kill()
    code, _, errors = flight.end()
    assert code == 1
    assert "plant ended by signal 9" in errors
    assert flight.closed_bag() == 101


def test_a_mission_that_is_killed_is_not_waited_for_and_a_dead_controller_ends_the_flight(
    tmp_path: Path, free_domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    flight = Begun(tmp_path / "bag", free_domain)

    def killed_before(*arguments: Any) -> None:
        os.kill(flight.processes["mission"].pid, signal.SIGKILL)
        set_parameters(*arguments)

    monkeypatch.setattr(simulation_calls, "set_parameters", killed_before)
    with pytest.raises(FlightError, match="mission_node has gone"):
        simulation_calls.go_to("{hold: 1}", free_domain, "")
    flight.processes["controller"].kill()
    code, _, errors = flight.end()
    assert code == 1
    assert "controller ended by signal 9" in errors
    assert flight.closed_bag() == 101


def test_recorder_without_room_costs_the_bag_and_the_exit_code(
    tmp_path: Path, free_domain: int
) -> None:
    """Not the flight: it is flown to its end."""
    flight = Begun(tmp_path / "bag", free_domain, "--duration", "0.5", "--json")
    resource.prlimit(flight.processes["recorder"].pid, resource.RLIMIT_FSIZE, (300_000, 300_000))
    flight.sim("resume")
    code, output, errors = flight.end()
    assert code == 1
    assert "could not be written to the end (File too large)" in errors
    assert "recorder_node: not recording" in errors
    report = json.loads(output)
    assert report["unfinished"]
    assert 0 < report["ticks"] < 1_000
    assert int(report["graph"]["nodes"]["plant_node"]["tick"]) == 1_000


def test_recorder_without_its_folder_says_so(tmp_path: Path, free_domain: int) -> None:
    flight = Begun(tmp_path / "bag", free_domain, "--duration", "0.2")
    shutil.rmtree(flight.bag)
    flight.sim("resume")
    code, _, errors = flight.end()
    assert code != 0
    assert "removed or moved" in errors
    assert not flight.bag.exists()


def test_nodes_of_a_killed_command_close_the_bag_and_the_next_flight_has_the_domain(
    tmp_path: Path, free_domain: int
) -> None:
    flight = Begun(tmp_path / "bag", free_domain)
    flight.process.kill()
    flight.process.wait()
    # at once, while they are still ending
    words = ("--duration", "0.1", "--domain", str(free_domain), "--bag", str(tmp_path / "next"))
    following = space_robot_here("fly", "--composed", *words)
    assert following.returncode == 0, following.stderr
    assert not psutil.wait_procs(flight.processes.values(), TIMEOUT_S)[1]
    assert flight.closed_bag() == 101


def test_nodes_of_a_command_killed_at_their_start_end(tmp_path: Path) -> None:
    """Before any Python of theirs runs."""
    flight = forked_space_robot("fly", "--bag", str(tmp_path / "bag"))
    command, until = psutil.Process(flight.pid), time.monotonic() + TIMEOUT_S
    while len(nodes := command.children(recursive=True)) < 5:  # with their server
        assert time.monotonic() < until
    flight.kill()
    flight.wait()
    assert not psutil.wait_procs(nodes, TIMEOUT_S)[1]
