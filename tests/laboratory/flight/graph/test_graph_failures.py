"""Flights that do not go to their end: no hang, no process, a readable bag, one clear line."""

from __future__ import annotations

import json
import resource
import shutil
import signal
import time
from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import psutil
import pytest
from bags import messages_of
from flights import forked_space_robot, space_robot_here
from forked import Forked

from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")

TIMEOUT_S = 90.0
SOME_FLIGHT = 200_000
"""Bytes of a bag with more than what is sent in advance."""


def nodes_of(flight: Forked) -> dict[str, psutil.Process]:
    """The processes of a flight's nodes by name."""
    nodes = {}
    for process in psutil.Process(flight.pid).children(recursive=True):
        with suppress(psutil.Error, IndexError):  # it has just ended
            name = process.cmdline()[0]
            if name.endswith(("_node", "composed")):
                nodes[name.removesuffix("_node")] = process
    return nodes


def wait_until(condition: Callable[[], bool], flight: Forked) -> None:
    until = time.monotonic() + TIMEOUT_S
    while not condition():
        assert flight.poll() is None, flight.communicate()[1]
        assert time.monotonic() < until
        time.sleep(0.01)


def has_flown(bag: Path) -> bool:
    file = bag / "bag_0.mcap"
    return file.exists() and file.stat().st_size > SOME_FLIGHT


def begun(bag: Path, *options: str) -> tuple[Forked, dict[str, psutil.Process]]:
    """A flight in progress, and its nodes."""
    flight = forked_space_robot("fly", "--bag", str(bag), *options)
    wait_until(lambda: has_flown(bag), flight)
    nodes = nodes_of(flight)
    assert len(nodes) == (1 if "--composed" in options else 4)
    return flight, nodes


@pytest.mark.parametrize(
    ("number", "options"), [(signal.SIGINT, ()), (signal.SIGTERM, ("--composed",))]
)
def test_interrupted_flight_leaves_a_closed_bag_and_no_process(
    tmp_path: Path, free_domain: int, number: signal.Signals, options: tuple[str, ...]
) -> None:
    bag, where = tmp_path / "bag", ("--domain", str(free_domain))
    flight, nodes = begun(bag, *options, *where)
    refused = space_robot_here("sim", "step", *where)
    assert refused.returncode == 1
    (line,) = refused.stderr.splitlines()
    assert "plant_node cannot step: it is not paused" in line
    flight.send_signal(number)
    _, errors = flight.communicate(timeout=60)
    assert flight.returncode == 128 + number
    assert "stopped at" in errors
    assert "Traceback" not in errors
    assert not any(node.is_running() for node in nodes.values())
    log = read_flight(bag)
    assert (log.unfinished, log.damage) == ("", ())
    assert log.ticks > 0
    assert not any(log.lost.values())


@pytest.mark.parametrize("victim", ["controller", "plant"])
def test_dead_node_ends_the_flight_with_an_error(tmp_path: Path, victim: str) -> None:
    flight, nodes = begun(tmp_path / "bag")
    nodes[victim].kill()
    _, errors = flight.communicate(timeout=60)
    assert flight.returncode == 1
    assert f"{victim} ended by signal 9" in errors
    assert not any(node.is_running() for node in nodes.values())
    assert read_flight(tmp_path / "bag").ticks > 0


def test_recorder_without_room_costs_the_bag_and_the_exit_code(tmp_path: Path) -> None:
    """Not the flight: it is flown to its end."""
    bag = tmp_path / "bag"
    flight, nodes = begun(bag, "--duration", "3", "--json")
    limit = (bag / "bag_0.mcap").stat().st_size + 300_000
    resource.prlimit(nodes["recorder"].pid, resource.RLIMIT_FSIZE, (limit, limit))
    output, errors = flight.communicate(timeout=120)
    assert flight.returncode == 1
    assert "could not be written to the end (File too large)" in errors
    assert "recorder_node: not recording" in errors
    report = json.loads(output)
    assert report["unfinished"]
    assert 0 < report["ticks"] < 6_000
    assert int(report["graph"]["nodes"]["plant_node"]["tick"]) == 6_000


def test_recorder_without_its_folder_says_so(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    flight, _ = begun(bag, "--duration", "3")
    shutil.rmtree(bag)
    _, errors = flight.communicate(timeout=120)
    assert flight.returncode != 0
    assert "removed or moved" in errors
    assert "Traceback" not in errors
    assert not bag.exists()


def test_diverging_flight_ends_with_its_tick_and_all_messages(tmp_path: Path) -> None:
    """Those of the flight in one process, to the last byte."""
    bags = {name: tmp_path / name for name in ("fly", "simulate")}
    found: dict[str, dict[str, list[bytes]]] = {}
    for command, bag in bags.items():
        how = ("--composed",) if command == "fly" else ()
        options = ("--gains", "printed", "--swap", "0.1:ctc", "--json", *how)
        result = space_robot_here(command, *options, "--bag", str(bag))
        assert result.returncode == 1
        assert "diverged at tick 209 (t = 0.1045 s)" in result.stderr
        assert "Traceback" not in result.stderr
        report = json.loads(result.stdout)
        assert report["diverged"]["tick"] == report["ticks"] == 209
        assert (report["outcome"], report["ended_at_s"]) == ("diverged", 0.1045)
        found[command] = defaultdict(list)
        for topic, data in messages_of(bag):
            found[command][topic.full_name].append(data)
    for topic, messages in found["simulate"].items():
        sent = found["fly"][topic]
        # the mission sends ahead of need
        assert messages == (sent[: len(messages)] if topic.startswith("/reference/") else sent)


def test_nodes_of_a_killed_command_close_the_bag_and_the_next_flight_has_the_domain(
    tmp_path: Path, free_domain: int
) -> None:
    bag, where = tmp_path / "bag", ("--domain", str(free_domain))
    flight, nodes = begun(bag, *where)
    flight.kill()
    flight.wait()
    # at once, while they are still ending
    following = space_robot_here(
        *("fly", "--composed", "--duration", "0.1", *where, "--bag", str(tmp_path / "next"))
    )
    assert following.returncode == 0, following.stderr
    assert not psutil.wait_procs(nodes.values(), TIMEOUT_S)[1]
    log = read_flight(bag)
    assert (log.unfinished, log.damage) == ("", ())
    assert log.ticks > 0


@pytest.mark.parametrize("moment", ["starting", "landing"])
def test_nodes_of_a_killed_command_end_whatever_they_are_at(
    moment: str, tmp_path: Path, free_domain: int
) -> None:
    """Before any Python of theirs runs; when the plant has ended, and the recorder takes the rest
    of a flight that nobody follows any more."""
    bag = tmp_path / "bag"
    options = ("--duration", "2", "--domain", str(free_domain), "--bag", str(bag))
    flight = forked_space_robot("fly", *options)
    wait_until(lambda: len(nodes_of(flight)) == 4, flight)
    nodes = nodes_of(flight)
    if moment == "landing":
        wait_until(lambda: has_flown(bag), flight)
        flight.send_signal(signal.SIGSTOP)
        wait_until(lambda: not is_alive(nodes["plant"]), flight)
    flight.kill()
    flight.wait()
    assert not psutil.wait_procs(nodes.values(), timeout=TIMEOUT_S)[1]
    if moment == "landing":
        log = read_flight(bag)
        assert (log.unfinished, log.damage, log.ticks) == ("", (), 4000)
        assert not any(log.lost.values())


def is_alive(process: psutil.Process) -> bool:
    try:
        return bool(process.status() != psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return False


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
        (["fly", "--composed", "--fault", "kill_controller@1"], "fault kill_controller@1"),
        (["fly", "--composed", "--fault", "stop_recorder@1:2"], "fly without --composed"),
        (["fly", "--composed", "--restart-controller"], "restart_controller"),
        (["sim", "step", "--ticks", "0"], "--ticks 0: 1 to 10000000000 were expected"),
        (["sim", "step", "--ticks", "-3"], "--ticks -3: 1 to 10000000000 were expected"),
        (["sim", "pause", "--namespace", "9"], "is not a namespace"),
        (["sim", "pause", "--domain", "101"], "no service /plant_node/pause in ROS domain"),
    ],
)
def test_bad_input_is_one_clear_line_and_exit_code_2(
    options: list[str], said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("space_robot.flight.graph.simulation_calls.FIND_S", 0.2)
    result = space_robot_here(*options)
    assert result.returncode == 2
    assert said in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())
