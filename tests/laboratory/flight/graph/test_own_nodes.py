"""Nodes of the user's own in a flight that starts the others: ``fly --without``."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from command import Run
from flights import forked_space_robot, ros_environment, space_robot_here, wait_for_nodes
from forked import END_S, Forked
from paths import ROOT

from space_robot.processes.node_modules import MODULES
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")
LAW_OF_THE_EXAMPLE = "pd"
Begin = Callable[..., Forked]


@pytest.fixture
def begin(free_domain: int) -> Iterator[Begin]:
    """Start the example, or a node of this project, in the domain of the flight."""
    running: list[Forked] = []

    def start(node: str = "", *arguments: str) -> Forked:
        environment = {**ros_environment(), "ROS_DOMAIN_ID": str(free_domain)}
        running.append(
            Forked(MODULES[node], arguments, environment)
            if node
            else Forked.of_command([str(ROOT / "examples/own_controller.py")], environment)
        )
        return running[-1]

    yield start
    for process in running:
        process.kill()
        process.communicate(END_S)


def test_a_controller_of_ones_own_flies_as_the_law_that_it_has(
    begin: Begin, free_domain: int, tmp_path: Path
) -> None:
    """Also if it comes first. The metrics are those of the shipped law to the printed digits."""
    process = begin()
    options = ("--duration", "0.2", "--json")
    result = space_robot_here(
        *("fly", "--without", "controller", "--domain", str(free_domain)),
        *("--bag", str(tmp_path / "bag"), *options),
    )
    assert result.returncode == 0, result.stderr
    assert f"your controller (a node that publishes /command) in ROS domain {free_domain}" in (
        result.stderr
    )
    assert "your controller is /own_controller" in result.stderr
    printed, errors = process.communicate(timeout=60)
    assert process.returncode == 0, errors
    assert printed.startswith("400 states answered")
    report = json.loads(result.stdout)
    assert (report["controller"], report["ticks"]) == ("none", 400)
    assert not any(report["lost"].values())
    assert report["unanswered_ticks"] == 0
    law = json.loads(
        space_robot_here("simulate", "--controller", LAW_OF_THE_EXAMPLE, *options).stdout
    )
    for metric, values in law["rms"]["mean_axis"].items():
        assert report["rms"]["mean_axis"][metric] == pytest.approx(values, rel=1e-5), metric
    replayed = space_robot_here("replay", str(tmp_path / "bag"))
    assert (replayed.returncode, "name the law" in replayed.stderr) == (2, True)


def test_one_that_dies_in_flight_ends_it_as_a_killed_controller_does(
    begin: Begin, free_domain: int, tmp_path: Path
) -> None:
    process, bag = begin(), tmp_path / "bag"
    flight = forked_space_robot(
        *("fly", "--without", "controller", "--domain", str(free_domain), "--duration", "20"),
        *("--set", "plant.silence_timeout=0.5", "--bag", str(bag), "--json"),
    )
    file, until = bag / "bag_0.mcap", time.monotonic() + 100.0
    while not (file.exists() and file.stat().st_size > 200_000):
        assert flight.poll() is None
        assert time.monotonic() < until
        time.sleep(0.05)
    process.send_signal(signal.SIGKILL)
    output, errors = flight.communicate(timeout=60)
    assert flight.returncode == 1, errors
    report = json.loads(output)
    assert report["outcome"] == "failed"
    assert "no command for 0.5 s (silence_timeout)" in report["reason"]
    assert "the controller is silent" in errors
    log = read_flight(bag)
    assert 0 < log.ticks < 100_000
    assert not any(log.lost.values())


def test_one_that_never_comes_ends_the_flight_in_time(
    space_robot: Run, free_domain: int, tmp_path: Path
) -> None:
    options = ("--domain", free_domain, "--join-timeout", 0.3, "--bag", tmp_path / "bag")
    ended = space_robot("fly", "--without", "controller", *options)
    assert ended.code == 1
    assert "no good command for tick 0 within 0.3 s (join_timeout)" in ended.err
    assert "publishers of /command in ROS domain" in ended.err
    assert not (tmp_path / "bag").exists()
    ended = space_robot("fly", "--without", "mission", *options)
    assert ended.code == 1
    assert "no reference for tick 0 within 0.3 s (join_timeout)" in ended.err


def test_both_may_be_ones_own(begin: Begin, free_domain: int, tmp_path: Path) -> None:
    """Here nodes of this project, started by hand, before the flight and after it."""
    mission, bag = begin("mission"), tmp_path / "bag"
    wait_for_nodes(free_domain)
    flight = forked_space_robot(
        *("fly", "--without", "controller", "--without", "mission", "--duration", "0.1"),
        *("--domain", str(free_domain), "--bag", str(bag), "--json"),
    )
    controller = begin("controller", "--ros-args", "-p", "controller:=pd")
    output, errors = flight.communicate(timeout=100)
    assert flight.returncode == 0, errors
    assert "your mission is /mission_node" in errors
    assert "your controller is /controller_node" in errors
    report = json.loads(output)
    assert (report["controller"], report["ticks"]) == ("pd", 200)
    assert open_bag(bag).messages(topics.LAW)
    assert (mission.poll(), controller.poll()) == (None, None)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ("controller --controller ctc", "controller: that is for the project's controller"),
        ("controller --gains robust --swap 1:ctc", "gains, swaps: that is for the project's"),
        ("controller --set controller.hold_ticks=3", "controller.hold_ticks: that is for"),
        ("mission --fault kill_mission@1", "fault kill_mission@1: that is for the project's"),
        ("controller --composed", "without: that needs a process for each node"),
        ("pilot", "--without: unknown value 'pilot': choose one of controller, mission"),
        ("mission --set plant.own_controller=true", "use --without controller"),
    ],
)
def test_what_a_node_that_is_not_started_would_do_is_refused(
    space_robot: Run, options: str, said: str
) -> None:
    ended = space_robot("fly", "--without", *options.split())
    assert ended.code == 2
    assert said in ended.err
