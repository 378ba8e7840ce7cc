"""A message taken as bytes tells who sent it, and how many that publisher had sent before."""

from __future__ import annotations

import ctypes
import time
from collections.abc import Iterator
from importlib import metadata
from typing import Any

import pytest

from space_robot_msgs_py import topics
from space_robot_msgs_py.ros.process_environment import set_defaults

set_defaults()
rclpy = pytest.importorskip("rclpy")

from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawPublisher, RawSubscription  # noqa: E402
from space_robot_msgs_py.ros.exclusive import GraphPublishers, TopicClaim  # noqa: E402
from space_robot_msgs_py.ros.locks import MOST_NOTES  # noqa: E402
from space_robot_msgs_py.ros.serialized_take import (  # noqa: E402
    ROOM,
    Received,
    SerializedTake,
    serialized_take,
    take_by_rclpy,
)
from space_robot_msgs_py.wire.sources import Claimed  # noqa: E402

TOPIC = topics.COMMAND
TIMEOUT_S = 30.0


@pytest.fixture
def node(domain: int) -> Iterator[rclpy.node.Node]:
    context = rclpy.Context()
    rclpy.init(args=[], context=context, domain_id=domain)
    node = rclpy.create_node("sender", context=context)
    yield node
    node.destroy_node()
    context.try_shutdown()


def _next(entry: RawSubscription) -> Received:
    until = time.monotonic() + TIMEOUT_S
    while (taken := entry.take_with_source()) is None:
        assert time.monotonic() < until
        time.sleep(0.001)
    return taken


def test_publisher_number_and_time_of_every_message(node: rclpy.node.Node) -> None:
    entry = RawSubscription(node, TOPIC, PolledCallbackGroup())
    first, second = RawPublisher(node, TOPIC), RawPublisher(node, TOPIC)
    until = time.monotonic() + TIMEOUT_S
    while not all(out._publisher.get_subscription_count() for out in (first, second)):
        assert time.monotonic() < until
    sizes = (16, 3 * ROOM, 40)  # more than there is room for, then less
    found: dict[bytes, list[int]] = {}
    begin_ns = time.time_ns()
    for number, size in enumerate(sizes, 1):
        for out in (first, second):
            data = b"\x00\x01\x00\x00" + bytes([number]) * (size - 4)
            out.publish(data)
            taken = _next(entry)
            assert taken.data == data
            assert begin_ns <= taken.sent_ns <= time.time_ns()
            found.setdefault(taken.publisher, []).append(taken.sequence)
    assert entry.take_with_source() is None
    assert list(found.values()) == [[1, 2, 3], [1, 2, 3]]
    assert (first.sent, second.sent) == (3, 3)
    names = GraphPublishers(node).names(TOPIC.name)
    assert {publisher: names[publisher] for publisher in found} == dict.fromkeys(found, "/sender")


def test_a_claim_tells_the_publishers_that_messages_are_from(node: rclpy.node.Node) -> None:
    entry, out, publishers = (
        RawSubscription(node, TOPIC, PolledCallbackGroup()),
        RawPublisher(node, TOPIC),
        GraphPublishers(node),
    )
    before = publishers.claimed(TOPIC.name)
    assert not before.is_held
    claim = TopicClaim(node, [TOPIC.name])
    while not out._publisher.get_subscription_count():
        time.sleep(0.001)
    out.publish(bytes(16))
    expected = (*before.publishers, _next(entry).publisher)[-MOST_NOTES:]
    assert publishers.claimed(TOPIC.name) == Claimed(expected, is_held=True)
    claim.release()
    assert publishers.claimed(TOPIC.name) == Claimed(expected, is_held=False)


def _no_version(package: str) -> str:
    raise metadata.PackageNotFoundError(package)


def _no_library(name: str) -> Any:
    raise OSError(name)


@pytest.fixture
def fresh() -> Iterator[None]:
    """Decided anew in the test, and again after it."""
    serialized_take.cache_clear()
    yield
    serialized_take.cache_clear()


def test_the_rclpy_here_tells_publishers(fresh: None) -> None:
    assert isinstance(serialized_take(), SerializedTake)


@pytest.mark.parametrize(
    ("where", "what", "instead"),
    [
        (metadata, "version", lambda package: "9.1.0"),
        (metadata, "version", _no_version),
        (ctypes, "CDLL", _no_library),
        (ctypes, "CDLL", lambda name: object()),
    ],
    ids=["another version", "no version", "no library", "no function"],
)
def test_where_rcl_is_not_as_expected_rclpy_takes(
    node: rclpy.node.Node,
    monkeypatch: pytest.MonkeyPatch,
    fresh: None,
    where: Any,
    what: str,
    instead: Any,
) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(where, what, instead)
        assert serialized_take() is take_by_rclpy
    entry, out = RawSubscription(node, TOPIC, PolledCallbackGroup()), RawPublisher(node, TOPIC)
    until = time.monotonic() + TIMEOUT_S
    while not out.listener_count:
        assert time.monotonic() < until
    begin_ns = time.time_ns()
    for number in (1, 2):
        data = bytes([0, 1, 0, 0, number])
        out.publish(data)
        taken = _next(entry)
        assert (taken.data, taken.publisher, taken.sequence) == (data, b"", number)
        assert begin_ns <= taken.sent_ns <= time.time_ns()
    assert entry.take_with_source() is None
