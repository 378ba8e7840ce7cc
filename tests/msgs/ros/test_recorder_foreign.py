"""A foreign program sends on every recorded topic: the bag is whole, and has none of it."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from bags import COLUMNS, messages_of, read_accounts
from flights import Start, ros_environment
from paths import TESTS

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.ros.process_environment import set_defaults

set_defaults()
pytest.importorskip("rclpy")

from space_robot_msgs_py.ros.endpoints import RawPublisher  # noqa: E402
from space_robot_msgs_py.ros.exclusive import TopicClaim  # noqa: E402

if TYPE_CHECKING:
    from ground import Ground

FLOOD = TESTS / "flood.py"
TIMEOUT_S = 30.0
RATE_HZ = 2000
"""Of the flight's messages."""


def wait(done: Callable[[], bool], what: str) -> None:
    until = time.monotonic() + TIMEOUT_S
    while not done():
        assert time.monotonic() < until, what
        time.sleep(0.01)


def size(bag: Path) -> int:
    return sum(file.stat().st_size for file in bag.glob("*.mcap"))


@pytest.fixture
def flood(request: pytest.FixtureRequest, domain: int) -> Iterator[subprocess.Popen[bytes]]:
    kind, rate_hz = request.param
    process = subprocess.Popen(
        [sys.executable, str(FLOOD), kind, str(rate_hz)],
        env={**ros_environment(), "ROS_DOMAIN_ID": str(domain)},
    )
    yield process
    process.kill()
    process.wait()


class Player:
    """Sends the messages of a bag as the graph's own publishers."""

    def __init__(self, ground: Ground) -> None:
        self._outs = {topic: RawPublisher(ground.node, topic) for topic in topics.RECORDED}
        self._claim = TopicClaim(ground.node, [topic.full_name for topic in topics.RECORDED])

    def is_heard(self) -> bool:
        """Whether the recorder is connected, beside all others that listen."""
        return all(
            not out.missing_listeners(["recorder_node"])
            and out.listener_count >= len(out._node.get_subscriptions_info_by_topic(topic.name))
            for topic, out in self._outs.items()
        )

    def send(self, messages: list[tuple[topics.Topic, bytes]]) -> None:
        begin = time.monotonic()
        for count, (topic, data) in enumerate(messages):
            self._outs[topic].publish(data)
            time.sleep(max(0.0, begin + count / RATE_HZ - time.monotonic()))

    def close(self) -> None:
        """Once all has arrived."""
        for out in self._outs.values():
            out.flush(TIMEOUT_S)
            out._node.destroy_publisher(out._publisher)
        self._claim.release()


@pytest.mark.parametrize(
    "flood",
    [("malformed", 100), ("echo", 300), ("future", 10)],
    indirect=True,
    ids=lambda given: given[0],
)
def test_the_bag_is_the_flight_and_nothing_else(
    start: Start, ground: Ground, tmp_path: Path, flood: subprocess.Popen[bytes]
) -> None:
    """Before the flight, in its midst, and after it; half-way our publishers are started again."""
    flown, bag = tmp_path / "flown", tmp_path / "bag"
    original = simulate(Flight(resolve(FlightPlan(duration=0.3))), flown)
    messages = list(messages_of(flown))
    recorder = start("recorder", bag=bag)
    wait(lambda: size(bag) > 0, "the recorder")
    for part in (messages[: len(messages) // 2], messages[len(messages) // 2 :]):
        player = Player(ground)
        wait(player.is_heard, "listeners")
        player.send(part)
        player.close()
    time.sleep(2.0)  # on a busy machine the flood is discovered late
    assert flood.poll() is None
    recorder.terminate()  # and the flood goes on
    output, _ = recorder.communicate(timeout=TIMEOUT_S)
    assert recorder.returncode == 0, output
    log, counts = read_flight(bag), read_accounts(bag)
    assert not log.unfinished
    assert not any(log.lost.values())
    assert log.whole.all()
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(log, name), getattr(original, name), name)
    for topic in (topics.JOINT_STATES, topics.COMMAND, topics.CLOCK):
        count = counts[topic.full_name]["foreign"]
        assert count > 0
        assert (
            f"{count} messages on {topic.full_name} were left out: they are from /flood"
            in log.foreign
        )
    assert "messages of /flood were left out" in output
