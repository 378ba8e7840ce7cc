"""Managed nodes: what each transition does, and what others are told."""

from __future__ import annotations

import os
import re
import signal
import time
from typing import Any

import numpy as np
import pytest
from flights import Start
from forked import Forked

from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.process_environment import set_defaults
from space_robot_msgs_py.samples import Command, RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec

set_defaults()
pytest.importorskip("rclpy")

from ground import Ground  # noqa: E402

from space_robot_model.robot import Robot  # noqa: E402
from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawPublisher, RawSubscription  # noqa: E402

TIMEBASE = Timebase(500_000)


def test_a_node_goes_through_its_life(start: Start, ground: Ground) -> None:
    plant = start("plant", autostart="false")
    joints = RawSubscription(ground.node, topics.JOINT_STATES, PolledCallbackGroup())
    assert ground.state("plant") == "unconfigured"
    assert not ground.change("plant", "activate")  # not from here; and it survives the asking
    assert ground.change("plant", "configure")
    assert ground.state("plant") == "inactive"
    time.sleep(0.5)
    assert joints.take() is None  # nothing is sent before activate
    assert ground.change("plant", "activate")
    ground.until(lambda: joints.take() is not None, "states")
    assert ground.change("plant", "deactivate")
    assert ground.change("plant", "cleanup")
    assert ground.state("plant") == "unconfigured"
    assert ground.change("plant", "configure")
    assert ground.change("plant", "activate")
    ground.until(lambda: joints.take() is not None, "states again")
    assert ground.change("plant", "active_shutdown")
    output, _ = plant.communicate(timeout=30)
    assert plant.returncode == 0, output
    assert "Traceback" not in output


def test_configure_fails_with_the_reason(start: Start, ground: Ground) -> None:
    plant = start("plant", autostart="false", case=9)
    assert not ground.change("plant", "configure")
    assert ground.state("plant") == "unconfigured"
    plant.send_signal(signal.SIGINT)
    output, _ = plant.communicate(timeout=30)
    assert "unknown case '9': choose one of 1, 2" in output
    assert plant.returncode == 0


def test_deactivated_controller_leaves_no_torque_and_comes_back(
    start: Start, ground: Ground
) -> None:
    controller = start("controller", longest_jump=20)
    nodes = [start("mission"), controller, start("plant", silence_timeout=0.3)]
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
    time.sleep(0.5)
    assert torque() == 0.0
    assert ground.change("controller", "activate")
    ground.until(lambda: torque() > 1e-3, "a torque again")
    assert all(node.poll() is None for node in nodes)
    controller.send_signal(signal.SIGINT)
    output, _ = controller.communicate(timeout=30)
    assert re.search(r"active again at tick \d+, after \d+", output), output
    assert "new time" not in output


@pytest.mark.parametrize(
    ("second", "said"),
    [
        ("plant", "has a /plant_node already"),
        ("controller", "has a /controller_node already"),
        ("mission", "has a /mission_node already"),
    ],
)
def test_a_second_node_of_a_kind_is_refused_by_name(
    start: Start, ground: Ground, second: str, said: str
) -> None:
    first = start(second)
    ground.until(lambda: f"{second}_node" in ground.monitor.values, "the first one")
    other = start(second)
    output, _ = other.communicate(timeout=60)
    assert other.returncode == 2
    assert said in output
    assert f"{second}_node (pid {first.pid})" in output
    assert first.poll() is None


def test_a_foreign_publisher_on_its_topic_keeps_a_node_from_flying(
    start: Start, ground: Ground
) -> None:
    RawPublisher(ground.node, topics.COMMAND)
    controller = start("controller", autostart="false")
    assert ground.change("controller", "configure")
    ground.until(lambda: ground.node.count_publishers("/command") == 2, "the controller")
    time.sleep(1.0)  # discovery is mutual, but not at the same moment
    assert not ground.change("controller", "activate")
    controller.send_signal(signal.SIGINT)
    output, _ = controller.communicate(timeout=30)
    assert f"/command is also published by /ground_{os.getpid()}" in output


class Rogue:
    """Sends bad commands, well formed or not, beside the controller."""

    def __init__(self, ground: Ground, axis_names: tuple[str, ...]) -> None:
        self._ground, self._out = ground, RawPublisher(ground.node, topics.COMMAND)
        self._names = axis_names

    def send(self, names: tuple[str, ...], torque: float, tick: int, stamp_ns: int = 0) -> None:
        timebase = Timebase(1) if stamp_ns else TIMEBASE
        command = Command(stamp_ns or tick, np.full(len(names), torque))
        self._out.publish(CommandCodec(names, timebase).encode(command))


def test_bad_commands_are_refused_counted_and_change_nothing(
    start: Start, ground: Ground, tmp_path: Any
) -> None:
    nodes: list[Forked] = [
        start("recorder", bag=tmp_path / "bag"),
        start("mission"),
        start("controller"),
        start("plant"),
    ]
    ground.until(lambda: ground.monitor.simulated_s > 0.1, "a flight")
    axes = Robot.from_yaml("config/robots/paper.yaml").axis_names
    rogue = Rogue(ground, axes)
    ground.until(lambda: bool(ground.node.count_subscribers("/command") >= 2), "listeners")

    def now() -> int:
        ground.monitor.poll()
        return round(ground.monitor.simulated_s * 2000)

    time.sleep(0.3)
    key = "refused: another publisher's on /command"
    for send in (
        lambda: rogue.send(tuple(f"x_{a}" for a in axes), 1e3, now()),
        lambda: rogue.send(axes[:4], 1e3, now()),
        lambda: rogue.send(axes, 1e3, now() + 100_000),
        lambda: rogue.send(axes, 1e3, 0, stamp_ns=123_456_789),
        lambda: rogue._out.publish(b"\x00\x01\x00\x00garbage"),
    ):
        before = ground.value("plant", key)
        send()
        ground.until(lambda b=before: ground.value("plant", key) > b, key)
    ground.until(
        lambda: "also published by" in ground.monitor.modes.get("controller_node", ""), "a warning"
    )
    assert all(node.poll() is None for node in nodes)
    for node in reversed(nodes):
        node.send_signal(signal.SIGINT)
        assert node.wait(30) == 0
