"""One publisher a topic: a second is refused."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator

import pytest

from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.ros.process_environment import DEFAULTS, set_defaults

set_defaults()
rclpy = pytest.importorskip("rclpy")

from space_robot_msgs_py.ros.endpoints import (  # noqa: E402
    PolledCallbackGroup,
    RawPublisher,
    RawSubscription,
    Received,
)
from space_robot_msgs_py.ros.exclusive import TopicClaim, foreign_publishers  # noqa: E402

TOPIC = topics.COMMAND
TIMEOUT_S = 30.0
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
Make = Callable[..., "rclpy.node.Node"]


def until(done: Callable[[], bool]) -> None:
    end = time.monotonic() + TIMEOUT_S
    while not done():
        assert time.monotonic() < end
        time.sleep(0.005)


@pytest.fixture
def make_node(domain: int) -> Iterator[Make]:
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


# Claims


def test_the_publisher_of_a_topic_is_alone_and_killed_leaves_its_place_at_once(
    make_node: Make, domain: int
) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", PUBLISHER],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, **DEFAULTS, "ROS_DOMAIN_ID": str(domain)},
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        node = make_node("controller", namespace="/robot")
        said = f"/command of ROS domain {domain} is already published by controller"
        with pytest.raises(InputError, match=re.escape(f"{said} (pid {process.pid})")):
            TopicClaim(node, ["/controller/telemetry", "/command"])
        # what it had got before the refusal is free again
        TopicClaim(make_node("other"), ["/controller/telemetry"]).release()
        from std_msgs.msg import String

        node.create_publisher(String, "/command", 1)
        until(lambda: foreign_publishers(node, ["/command", "/x"]) == {"/command": ["/controller"]})
        process.send_signal(signal.SIGKILL)
        process.wait()
        names = [info.node_name for info in node.get_publishers_info_by_topic("/command")]
        assert names.count("controller") == 2, "discovery still lists the dead one"
        TopicClaim(node, ["/command"]).release()
    finally:
        process.kill()
        process.communicate()


# Messages


def _next(entry: RawSubscription) -> Received:
    found: list[Received] = []

    def is_there() -> bool:
        found.extend(filter(None, [entry.take_with_info()]))
        return bool(found)

    until(is_there)
    return found[0]


def test_number_and_time_of_every_message(make_node: Make) -> None:
    node = make_node("sender")
    entry = RawSubscription(node, TOPIC, PolledCallbackGroup())
    out = RawPublisher(node, TOPIC)
    until(lambda: out.listener_count > 0)
    begin_ns = time.time_ns()
    for number, size in enumerate((16, 12_000, 40), 1):
        data = b"\x00\x01\x00\x00" + bytes([number]) * (size - 4)
        out.publish(data)
        taken = _next(entry)
        assert (taken.data, taken.sequence) == (data, number)
        assert begin_ns <= taken.sent_ns <= time.time_ns()
    assert entry.take_with_info() is None
    assert out.sent == 3
