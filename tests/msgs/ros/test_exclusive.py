"""One publisher a topic: a second is refused, a killed one's place is free, others are named."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.ros.process_environment import DEFAULTS, set_defaults

set_defaults()
rclpy = pytest.importorskip("rclpy")

from space_robot_msgs_py.ros.exclusive import TopicClaim, claim_name, foreign_publishers  # noqa: E402

PUBLISHER = """
import sys, time
from space_robot_msgs_py.ros.process_environment import set_defaults
set_defaults()
import rclpy
from std_msgs.msg import String
from space_robot_msgs_py.ros.exclusive import TopicClaim
rclpy.init()
node = rclpy.create_node("controller")
claim = TopicClaim(node, ["/command"])
publisher = node.create_publisher(String, "/command", 1)
print("ready", flush=True)
time.sleep(60)
"""


@pytest.fixture
def make_node(domain: int) -> Iterator[Callable[..., rclpy.node.Node]]:
    made = []

    def make(name: str, **options: object) -> rclpy.node.Node:
        context = rclpy.Context()
        rclpy.init(args=[], context=context, domain_id=domain)
        made.append(rclpy.create_node(name, context=context, **options))
        return made[-1]

    yield make
    for node in made:  # now, not by a collection of garbage in another test
        node.destroy_node()
        node.context.try_shutdown()


@pytest.fixture
def controller(domain: int) -> Iterator[subprocess.Popen[str]]:
    """A process that has claimed /command and publishes on it."""
    environment = {**os.environ, **DEFAULTS, "ROS_DOMAIN_ID": str(domain)}
    process = subprocess.Popen(
        [sys.executable, "-c", PUBLISHER], stdout=subprocess.PIPE, text=True, env=environment
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    yield process
    process.kill()
    process.communicate()


def _eventually(condition: Callable[[], bool], patience_s: float = 20.0) -> bool:
    until = time.monotonic() + patience_s
    while not condition() and time.monotonic() < until:
        time.sleep(0.05)
    return condition()


def test_second_publisher_is_refused_by_name(
    controller: subprocess.Popen[str], make_node: Callable[..., rclpy.node.Node], domain: int
) -> None:
    node = make_node("controller")
    said = f"/command of ROS domain {domain} is already published by controller"
    with pytest.raises(InputError, match=re.escape(f"{said} (pid {controller.pid})")):
        TopicClaim(node, ["/controller/telemetry", "/command"])
    # what it had got before the refusal is free again
    TopicClaim(make_node("other"), ["/controller/telemetry"]).release()


def test_killed_publisher_leaves_its_place_at_once(
    controller: subprocess.Popen[str], make_node: Callable[..., rclpy.node.Node]
) -> None:
    """Discovery still lists the dead one, under its successor's name."""
    node = make_node("controller")

    def seen() -> list[str]:
        return [info.node_name for info in node.get_publishers_info_by_topic("/command")]

    assert _eventually(lambda: seen() == ["controller"])
    controller.send_signal(signal.SIGKILL)
    controller.wait()
    assert seen() == ["controller"]
    assert foreign_publishers(node, ["/command"]) == {}
    TopicClaim(node, ["/command"]).release()


def test_remapped_topics_and_other_topics_do_not_meet(
    make_node: Callable[..., rclpy.node.Node],
) -> None:
    node = make_node("controller")
    moved = make_node("controller", cli_args=["--ros-args", "-r", "/command:=/spare/command"])
    claims = [TopicClaim(node, ["/command"]), TopicClaim(moved, ["/command"])]
    with pytest.raises(InputError, match="/spare/command of ROS domain"):
        TopicClaim(node, ["/spare/command"])
    for claim in claims:
        claim.release()


def test_foreign_publishers_are_named_and_own_publishers_are_not(
    controller: subprocess.Popen[str], make_node: Callable[..., rclpy.node.Node]
) -> None:
    from std_msgs.msg import String

    node = make_node("watch", namespace="/robot")
    node.create_publisher(String, "/command", 1)
    topics = ["/command", "/joint_states"]
    assert _eventually(lambda: foreign_publishers(node, topics) == {"/command": ["/controller"]})


def test_two_nodes_of_one_name_are_refused(
    make_node: Callable[..., rclpy.node.Node], domain: int
) -> None:
    """Whoever asks /recorder_node to configure means one of them."""
    name = claim_name(make_node("recorder_node"))
    said = f"ROS domain {domain} has a /recorder_node already: recorder_node (pid {os.getpid()})"
    with pytest.raises(InputError, match=re.escape(said)):
        claim_name(make_node("recorder_node"))
    claim_name(make_node("recorder_node", namespace="/other")).release()
    name.release()
    claim_name(make_node("recorder_node")).release()
