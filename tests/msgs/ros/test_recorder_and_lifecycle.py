"""Real nodes: what each transition does, who is refused, and how the recorder stops in flight."""

from __future__ import annotations

import re
import signal
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from bags import read_accounts
from flights import Start
from forked import Forked

from space_robot.flight.graph.node_names import wait_for
from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.ros.process import set_defaults
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.codecs import StateCodec

set_defaults()
pytest.importorskip("rclpy")

from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription  # noqa: E402

if TYPE_CHECKING:
    from ground import Ground

TIMEBASE = Timebase(500_000)
END_S = 30
Nodes = dict[str, Forked]


def ended(node: Forked, number: signal.Signals = signal.SIGINT) -> str:
    """End a node by a signal; return what it has written."""
    node.send_signal(number)
    output, _ = node.communicate(timeout=END_S)
    assert node.returncode == 0, output
    assert "Traceback" not in output
    return output


def test_a_node_goes_through_its_life(start: Start, ground: Ground) -> None:
    """Nothing is sent before it is active; one of its kind beside it is refused by name."""
    plant = start("plant", autostart="false")
    joints = RawSubscription(ground.node, topics.JOINT_STATES, PolledCallbackGroup())
    assert ground.state("plant") == "unconfigured"
    assert not ground.change("plant", "activate")  # not from here; and it survives the asking
    for _ in range(2):
        assert ground.change("plant", "configure")
        assert ground.state("plant") == "inactive"
        assert joints.take() is None
        assert ground.change("plant", "activate")
        ground.until(lambda: joints.take() is not None, "states")
        assert ground.change("plant", "deactivate")
        assert ground.change("plant", "cleanup")
        assert ground.state("plant") == "unconfigured"
        while joints.take() is not None:
            pass
    other = start("plant")
    output, _ = other.communicate(timeout=2 * END_S)
    assert other.returncode == 2
    assert f"has a /plant_node already: plant_node (pid {plant.pid})" in output
    assert ground.change("plant", "unconfigured_shutdown")
    output, _ = plant.communicate(timeout=END_S)
    assert plant.returncode == 0, output
    assert "Traceback" not in output


def test_configure_fails_with_the_reason(start: Start, ground: Ground) -> None:
    plant = start("plant", autostart="false", case=9)
    assert not ground.change("plant", "configure")
    assert ground.state("plant") == "unconfigured"
    assert "unknown case '9': choose one of 1, 2" in ended(plant)


@pytest.fixture
def bag(tmp_path: Path) -> Path:
    return tmp_path / "bag"


@pytest.fixture
def flying(start: Start, ground: Ground, bag: Path) -> Nodes:
    """The four nodes, some ticks after the first."""
    recorder = start("recorder", bag=bag)
    ground.until(lambda: "recorder_node" in ground.monitor.modes, "the recorder")
    nodes = {"recorder": recorder, "mission": start("mission")}
    nodes["controller"] = start("controller", wait_for=wait_for("controller"), longest_jump=20)
    nodes["plant"] = start("plant", wait_for=wait_for("plant"), silence_timeout=0.2)
    go_on(ground)
    return nodes


def go_on(ground: Ground, seconds: float = 0.1) -> None:
    """Let some simulated time pass."""
    ground.monitor.poll()
    begin = ground.monitor.simulated_s
    ground.until(lambda: ground.monitor.simulated_s > begin + seconds, "a flight")


def test_deactivated_controller_leaves_no_torque_and_comes_back(
    flying: Nodes, ground: Ground
) -> None:
    robot = Robot.from_yaml("config/robots/paper.yaml")
    codec = StateCodec(RobotNames(robot.joint_names), TIMEBASE)
    state = RobotState.allocate(robot.n)
    joints = RawSubscription(ground.node, topics.JOINT_STATES, PolledCallbackGroup())

    def torque() -> float:
        while (data := joints.take()) is not None:
            codec.decode(topics.JOINT_STATES, data, state)
        return float(np.abs(state.applied_torque[3:]).max())

    ground.until(lambda: torque() > 1e-3, "a torque")
    assert ground.change("controller", "deactivate")
    ground.until(lambda: torque() == 0.0, "no torque")
    go_on(ground)
    assert torque() == 0.0
    assert ground.change("controller", "activate")
    ground.until(lambda: torque() > 1e-3, "a torque again")
    assert all(node.poll() is None for node in flying.values())
    output = ended(flying["controller"])
    before, again, _ = re.split(r"(active again at tick \d+, after \d+)", output, maxsplit=1)
    assert again
    assert "new time" not in before


def test_a_signal_ends_the_recorder_in_flight(flying: Nodes, bag: Path) -> None:
    ended(flying["recorder"], signal.SIGTERM)
    assert flying["plant"].poll() is None
    counts = read_accounts(bag)  # of a finished bag only
    assert counts["/joint_states"]["received"] > 100
    assert {name: count["missing"] for name, count in counts.items() if count["missing"]} == {}


def test_what_was_never_sent_is_not_lost_and_all_are_cleaned_up_in_flight(
    flying: Nodes, ground: Ground, bag: Path
) -> None:
    """A controller that stood still; then both requests of each are on their way at once.

    None may reach a loop that still runs, while the others fly on.
    """
    flying["controller"].send_signal(signal.SIGSTOP)
    before = ground.value("plant", "missed_deadlines")  # a busy machine misses some by itself
    ground.until(
        lambda: ground.value("plant", "missed_deadlines") > before + 400, "missed deadlines"
    )
    flying["controller"].send_signal(signal.SIGCONT)
    go_on(ground)
    for node in ("recorder", "controller", "mission", "plant"):
        assert all(ground.change_at_once(node, flying[node], "deactivate", "cleanup")), node
        assert ground.state(node) == "unconfigured"
        assert flying[node].poll() is None, node
        assert "Invalid" not in ended(flying[node], signal.SIGTERM)
    log, counts = read_flight(bag), read_accounts(bag)
    assert log.unanswered > 200
    assert not any(log.lost.values())
    assert {name: count["missing"] for name, count in counts.items() if count["missing"]} == {}
