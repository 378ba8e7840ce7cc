"""Nodes killed at any moment: the next one of its kind comes up and talks."""

from __future__ import annotations

import os
import random
import time
from collections.abc import Iterator

import pytest
from flights import Start

from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.process_environment import set_defaults

set_defaults()
rclpy = pytest.importorskip("rclpy")

from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription  # noqa: E402

ROUNDS = 4
OUTPUTS = {"plant": topics.JOINT_STATES, "controller": topics.COMMAND}
TIMEOUT_S = 30.0


class Listener:
    """Hears what plant and controller say."""

    def __init__(self, domain: int) -> None:
        self.context = rclpy.Context()
        rclpy.init(args=[], context=self.context, domain_id=domain)
        self.node = rclpy.create_node(f"listener_{os.getpid()}", context=self.context)
        group = PolledCallbackGroup()
        self._inputs = {
            name: RawSubscription(self.node, topic, group) for name, topic in OUTPUTS.items()
        }

    def forget(self, name: str) -> None:
        """Drop what the node has said so far."""
        while self._inputs[name].take() is not None:
            pass

    def hears(self, name: str) -> bool:
        """Whether the node says something in time."""
        until = time.monotonic() + TIMEOUT_S
        while time.monotonic() < until:
            if self._inputs[name].take() is not None:
                return True
            time.sleep(0.01)
        return False


@pytest.fixture
def listener(domain: int) -> Iterator[Listener]:
    it = Listener(domain)
    yield it
    it.node.destroy_node()
    it.context.try_shutdown()


def test_a_killed_node_never_keeps_its_successor_from_the_graph(
    start: Start, listener: Listener
) -> None:
    chance = random.Random(1)
    start("mission")
    running = {name: start(name) for name in OUTPUTS}
    for _ in range(ROUNDS):
        victim = chance.choice(sorted(OUTPUTS))
        time.sleep(chance.uniform(0.0, 1.0))  # joining the graph, in traffic
        running[victim].kill()
        running[victim].wait()
        listener.forget(victim)
        running[victim] = start(victim)
        assert listener.hears(victim), victim
    assert [process.poll() for process in running.values()] == [None, None]
