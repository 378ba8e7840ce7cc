"""The recorder told to stop while the plant flies: at a definite moment, with a whole bag."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from bags import read_accounts
from flights import Start
from forked import Forked

from space_robot.flight.graph.listeners import wait_for
from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")

if TYPE_CHECKING:
    from ground import Ground

Nodes = dict[str, Forked]


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    return tmp_path / "bag"


@pytest.fixture
def flying(start: Start, ground: Ground, bag: Path) -> Nodes:
    """The four nodes, some ticks after the first."""
    recorder = start("recorder", bag=bag)
    ground.until(lambda: "recorder_node" in ground.monitor.modes, "the recorder")
    nodes = {"recorder": recorder, "mission": start("mission")}
    nodes["controller"] = start("controller", wait_for=wait_for("controller"))
    nodes["plant"] = start("plant", wait_for=wait_for("plant"), silence_timeout=0.2)
    go_on(ground)
    return nodes


def go_on(ground: Ground, seconds: float = 0.1) -> None:
    """Let some simulated time pass."""
    ground.monitor.poll()
    begin = ground.monitor.simulated_s
    ground.until(lambda: ground.monitor.simulated_s > begin + seconds, "a flight")


def size(bag: Path) -> int:
    return sum(file.stat().st_size for file in bag.glob("*.mcap"))


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_it_in_flight(
    flying: Nodes, ground: Ground, bag: Path, number: signal.Signals
) -> None:
    recorder = flying["recorder"]
    recorder.send_signal(number)
    output, _ = recorder.communicate(timeout=30)
    assert recorder.returncode == 0, output
    assert flying["plant"].poll() is None
    counts = read_accounts(bag)  # of a finished bag only
    assert counts["/joint_states"]["received"] > 100
    assert {name: count["missing"] for name, count in counts.items() if count["missing"]} == {}


def test_inactive_it_writes_nothing_and_then_goes_on(
    flying: Nodes, ground: Ground, bag: Path
) -> None:
    assert ground.change("recorder", "deactivate")
    inactive = size(bag)
    go_on(ground, 0.5)
    assert size(bag) == inactive
    assert ground.change("recorder", "activate")
    go_on(ground, 0.3)
    assert ground.change("recorder", "deactivate")
    assert ground.change("recorder", "cleanup")  # while the plant flies
    assert ground.state("recorder") == "unconfigured"
    assert all(node.poll() is None for node in flying.values())
    log = read_flight(bag)
    assert not log.unfinished
    assert not any(log.lost.values())
    assert any("sent while the recorder was inactive" in text for text in log.damage)
    assert any("lack state or reference" in text for text in log.damage)
    flying["recorder"].send_signal(signal.SIGINT)
    assert flying["recorder"].wait(30) == 0


def test_cleaned_up_in_flight(flying: Nodes, ground: Ground) -> None:
    """Both requests are on their way at once: none may reach a loop that still runs.

    One node after the other, while those that are left fly on.
    """
    for node in ("recorder", "controller", "mission", "plant"):
        go_on(ground)
        assert all(ground.change_at_once(node, flying[node], "deactivate", "cleanup")), node
        assert ground.state(node) == "unconfigured"
        assert flying[node].poll() is None, node
        flying[node].send_signal(signal.SIGINT)
        output, _ = flying[node].communicate(timeout=30)
        assert flying[node].returncode == 0, output
        assert "Invalid" not in output


def test_what_was_never_sent_is_not_lost(flying: Nodes, ground: Ground, bag: Path) -> None:
    """A controller that stood still, a plant that was ended before its last answer."""
    flying["controller"].send_signal(signal.SIGSTOP)
    before = ground.value("plant", "missed_deadlines")  # a busy machine misses some by itself
    ground.until(
        lambda: ground.value("plant", "missed_deadlines") > before + 400, "missed deadlines"
    )
    flying["controller"].send_signal(signal.SIGCONT)
    go_on(ground, 0.1)
    for name in ("plant", "controller", "mission", "recorder"):
        flying[name].send_signal(signal.SIGTERM)
        output, _ = flying[name].communicate(timeout=30)
        assert flying[name].returncode == 0, output
    log, counts = read_flight(bag), read_accounts(bag)
    assert log.unanswered > 200
    assert not any(log.lost.values())
    assert {name: count["missing"] for name, count in counts.items() if count["missing"]} == {}
