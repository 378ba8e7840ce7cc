"""``fly`` killed by SIGKILL: its nodes end well, whatever they were at, and the domain is free."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable
from pathlib import Path

import psutil
import pytest
from flights import forked_space_robot, space_robot_here
from forked import Forked

from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")

TIMEOUT_S = 90.0


def _start(bag: Path, domain: int, *options: str) -> Forked:
    return forked_space_robot("fly", "--bag", str(bag), "--domain", str(domain), *options)


def _nodes(flight: Forked) -> list[psutil.Process]:
    return [
        child
        for child in psutil.Process(flight.pid).children(recursive=True)
        if any(word.endswith("_node") for word in _words(child))
    ]


def _words(process: psutil.Process) -> list[str]:
    try:
        return process.cmdline()
    except psutil.Error:  # it has just ended
        return []


def _has_ended(process: psutil.Process) -> bool:
    try:
        return process.status() == psutil.STATUS_ZOMBIE
    except psutil.NoSuchProcess:
        return True


def _wait_until(condition: Callable[[], bool], flight: Forked) -> None:
    until = time.monotonic() + TIMEOUT_S
    while not condition():
        assert flight.poll() is None
        assert time.monotonic() < until
        time.sleep(0.01)


def test_nodes_close_the_bag_and_the_next_flight_has_the_domain(
    tmp_path: Path, free_domain: int
) -> None:
    bag = tmp_path / "bag"
    file = bag / "bag_0.mcap"
    flight = _start(bag, free_domain)
    _wait_until(lambda: file.exists() and file.stat().st_size > 1_000_000, flight)
    nodes = _nodes(flight)
    assert len(nodes) == 4
    flight.kill()
    flight.wait()
    # at once, while they are still ending
    following = space_robot_here(
        "fly", "--duration", "0.2", "--domain", str(free_domain), "--bag", str(tmp_path / "next")
    )
    assert following.returncode == 0, following.stderr
    psutil.wait_procs(nodes, TIMEOUT_S)
    assert not any(node.is_running() for node in nodes)
    log = read_flight(bag)
    assert not log.unfinished
    assert not log.damage
    assert log.ticks > 100


@pytest.mark.parametrize("moment", ["starting", "configuring"])
def test_nodes_that_do_not_fly_yet_end_too(moment: str, tmp_path: Path, free_domain: int) -> None:
    """Before any Python of theirs runs, and with the bag just made."""
    bag = tmp_path / "bag"
    flight = _start(bag, free_domain)
    if moment == "configuring":
        _wait_until((bag / "bag_0.mcap").exists, flight)
    _wait_until(lambda: len(_nodes(flight)) == 4, flight)
    nodes = _nodes(flight)
    flight.kill()
    flight.wait()
    _, alive = psutil.wait_procs(nodes, timeout=TIMEOUT_S)
    assert not alive


def test_stopped_node_ends_when_it_goes_on(tmp_path: Path, free_domain: int) -> None:
    bag = tmp_path / "bag"
    flight = _start(bag, free_domain)
    _wait_until(lambda: (bag / "bag_0.mcap").exists(), flight)
    stopped, *others = _nodes(flight)
    stopped.send_signal(signal.SIGSTOP)
    flight.kill()
    flight.wait()
    assert not psutil.wait_procs(others, timeout=TIMEOUT_S)[1]
    assert stopped.is_running()
    stopped.send_signal(signal.SIGCONT)
    stopped.wait(timeout=TIMEOUT_S)


def test_killed_while_landing(tmp_path: Path, free_domain: int) -> None:
    """The plant has ended, the recorder still takes what is left."""
    bag = tmp_path / "bag"
    flight = _start(bag, free_domain, "--duration", "0.3")
    _wait_until(lambda: len(_nodes(flight)) == 4, flight)
    nodes = _nodes(flight)
    (plant,) = (n for n in nodes if any(word.endswith("plant_node") for word in _words(n)))
    _wait_until(lambda: _has_ended(plant), flight)
    flight.kill()
    flight.wait()
    assert not psutil.wait_procs(nodes, timeout=TIMEOUT_S)[1]
    log = read_flight(bag)
    assert (log.unfinished, log.damage, log.ticks) == ("", (), 600)
    assert not any(log.lost.values())
