"""What is taken of a topic that several publish."""

from __future__ import annotations

import time
from collections.abc import Iterator

import pytest

pytest.importorskip("rclpy")

import rclpy
from rclpy.node import Node

from space_robot_msgs_py import topics
from space_robot_msgs_py.ros import trusted_subscription
from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawPublisher
from space_robot_msgs_py.ros.exclusive import TopicClaim
from space_robot_msgs_py.ros.trusted_subscription import TrustedSubscription
from space_robot_msgs_py.wire.clock import ClockCodec

TIMEOUT_S = 10.0


@pytest.fixture
def nodes(free_domain: int) -> Iterator[list[Node]]:
    """A listener, the graph's own publisher, and a foreign one."""
    contexts = [rclpy.Context() for _ in range(3)]
    made = []
    for name, context in zip(("listener", "own", "foreign"), contexts, strict=True):
        rclpy.init(context=context, domain_id=free_domain)
        made.append(rclpy.create_node(name, context=context))
    yield made
    for node, context in zip(made, contexts, strict=True):
        node.destroy_node()
        context.try_shutdown()


class Bench:
    """The listener's subscription and both publishers, connected."""

    def __init__(self, nodes: list[Node]) -> None:
        listener, own, foreign = nodes
        self.input = TrustedSubscription(listener, topics.CLOCK, PolledCallbackGroup(), 100)
        self.own, self.foreign = (RawPublisher(node, topics.CLOCK) for node in (own, foreign))
        self.own_node = own
        until = time.monotonic() + TIMEOUT_S
        while self.own.listener_count + self.foreign.listener_count < 2:
            assert time.monotonic() < until
            time.sleep(0.01)

    @staticmethod
    def send(publisher: RawPublisher, *ticks: int) -> None:
        for tick in ticks:
            publisher.publish(ClockCodec().encode(tick))
        publisher.flush(TIMEOUT_S)

    def taken(self, count: int) -> list[bytes]:
        """Take until ``count`` messages have come, and a little longer."""
        found: list[bytes] = []
        until = time.monotonic() + TIMEOUT_S
        while len(found) < count and time.monotonic() < until:
            if (data := self.input.take()) is not None:
                found.append(data)
        time.sleep(0.05)
        assert self.input.take() is None
        return found


def stamps(*ticks: int) -> list[bytes]:
    return [ClockCodec().encode(tick) for tick in ticks]


def test_of_a_claimed_topic_only_its_owner_is_heard(nodes: list[Node]) -> None:
    """Whoever came first, and though the other sends the same."""
    bench = Bench(nodes)
    claim = TopicClaim(bench.own_node, [topics.CLOCK.name])
    bench.send(bench.foreign, 7, 8)
    bench.send(bench.own, 1, 2)
    bench.send(bench.foreign, 3)
    bench.send(bench.own, 3)
    assert bench.taken(3) == stamps(1, 2, 3)
    assert bench.input.counts("refused") == {
        f"refused: another publisher's on {bench.input.full_name}": 3
    }
    claim.release()


def test_of_a_topic_that_nobody_claims_the_first_is_heard(nodes: list[Node]) -> None:
    bench = Bench(nodes)
    bench.send(bench.foreign, 7)
    assert bench.taken(1) == stamps(7)
    bench.send(bench.own, 1)
    bench.send(bench.foreign, 8)
    assert bench.taken(1) == stamps(8)


def test_who_claims_it_later_is_heard_from_then_on(nodes: list[Node]) -> None:
    bench = Bench(nodes)
    bench.send(bench.foreign, 7)
    assert bench.taken(1) == stamps(7)
    claim = TopicClaim(bench.own_node, [topics.CLOCK.name])
    bench.send(bench.own, 1)
    bench.send(bench.foreign, 8)
    bench.send(bench.own, 2)
    assert bench.taken(2) == stamps(1, 2)
    claim.release()


def test_a_flood_gives_other_work_its_turn(
    nodes: list[Node], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(trusted_subscription, "MOST_REFUSED", 5)
    bench = Bench(nodes)
    claim = TopicClaim(bench.own_node, [topics.CLOCK.name])
    bench.send(bench.foreign, *range(12))
    bench.send(bench.own, 1)
    time.sleep(0.2)
    assert [bench.input.take() for _ in range(3)] == [None, None, *stamps(1)]
    claim.release()
