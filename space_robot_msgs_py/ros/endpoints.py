"""Publishers and subscriptions of a loop that takes messages without executor.

The executor would take more time than the loop itself, so the loop's subscriptions are excluded
from it (`PolledCallbackGroup`), and messages are taken as raw bytes; the executor only serves
parameters.
"""

from __future__ import annotations

import importlib
import time
from collections.abc import Sequence
from typing import Any, NamedTuple

from rclpy.callback_groups import CallbackGroup
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import serialize_message
from rclpy.topic_endpoint_info import TopicEndpointInfo
from std_msgs.msg import Bool

from .. import topics
from ..errors import MessageError
from ..topics import Topic
from ..wire.definitions import decode
from .rclpy_internals import raw_publish, take_serialized


class PolledCallbackGroup(CallbackGroup):
    """Excludes its subscriptions from every executor."""

    def can_execute(self, entity: Any) -> bool:
        """Allow none."""
        return False


def full_node_name(info: TopicEndpointInfo) -> str:
    """Return the full name of an endpoint's node."""
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"


def message_type(name: str) -> Any:
    """Return the Python class of a ``package/msg/Type``."""
    package, _, type_name = name.partition("/msg/")
    return getattr(importlib.import_module(f"{package}.msg"), type_name)


def qos(topic: Topic) -> QoSProfile:
    """Return the quality of service: reliable, with the topic's depth and durability."""
    durable = DurabilityPolicy.TRANSIENT_LOCAL if topic.transient_local else None
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=topic.depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=durable or DurabilityPolicy.VOLATILE,
    )


class RawPublisher:
    """A publisher of serialized messages."""

    def __init__(self, node: Node, topic: Topic) -> None:
        self.topic = topic
        self._node = node
        self._publisher = node.create_publisher(message_type(topic.type), topic.name, qos(topic))
        self._publish = raw_publish(self._publisher)
        self.full_name = str(self._publisher.topic_name)
        """Full topic name: in the node's namespace, with remappings."""
        self.sent = 0
        """Number of sent messages."""

    def publish(self, data: bytes) -> None:
        """Send serialized bytes."""
        self.sent += 1
        self._publish(data)

    def flush(self, timeout_s: float) -> None:
        """Wait until all subscribers have acknowledged all sent messages."""
        self._publisher.wait_for_all_acked(Duration(seconds=timeout_s))

    @property
    def listener_count(self) -> int:
        """Number of connected subscriptions."""
        return int(self._publisher.get_subscription_count())

    def missing_listeners(self, names: Sequence[str]) -> list[str]:
        """Return the nodes that should subscribe to this topic but do not yet.

        Args:
            names: ``NODE:TOPIC``, a node that must subscribe to that topic, or ``NODE``, for
                every topic. Nodes without namespace are in that of this node.
        """
        awaited = [entry.partition(":") for entry in names if entry]
        nodes = [node for node, _, topic in awaited if topic.strip("/") in ("", self.topic.name)]
        infos = self._node.get_subscriptions_info_by_topic(self.topic.name)
        listening = {full_node_name(info) for info in infos}
        here = self._node.get_namespace().rstrip("/")
        missing = [
            name
            for name in nodes
            if (name if name.startswith("/") else f"{here}/{name}") not in listening
        ]
        if not missing and self.listener_count < len(nodes):
            return nodes  # discovered, but not all matched with this publisher yet
        return missing


def flush(outputs: Sequence[RawPublisher], timeout_s: float) -> None:
    """Wait until all subscribers have acknowledged all messages sent by some publishers."""
    until = time.monotonic() + timeout_s
    for output in outputs:
        output.flush(max(0.0, until - time.monotonic()))


NOT_COUNTED = (1 << 64) - 1
"""Sequence number in rmw of a middleware without sequence numbers."""


class Received(NamedTuple):
    """A serialized message with its origin."""

    data: bytes
    sent_ns: int
    """Time of sending by the sender's clock, ns since 1970."""
    sequence: int
    """The publisher's number of the message, from 1; 0: unknown."""


class RawSubscription:
    """A subscription to serialized messages, which are taken without executor."""

    def __init__(
        self,
        node: Node,
        topic: Topic,
        group: PolledCallbackGroup,
        depth: int = 0,
        best_effort: bool = False,
    ) -> None:
        """Subscribe, with the topic's own depth if ``depth`` is 0.

        With ``best_effort`` the publisher never waits or resends.
        """
        self.topic, self._node = topic, node
        profile = qos(topic)
        profile.depth = depth or topic.depth
        if best_effort:
            profile.reliability = ReliabilityPolicy.BEST_EFFORT
        self._subscription = node.create_subscription(
            message_type(topic.type),
            topic.name,
            lambda message: None,  # never called: the loop takes messages itself
            profile,
            raw=True,
            callback_group=group,
        )
        self.full_name = str(self._subscription.topic_name)
        """Full topic name: in the node's namespace, with remappings."""
        self.handle = self._subscription.handle
        self._type = self._subscription.msg_type

    def close(self) -> None:
        """End the subscription."""
        self._node.destroy_subscription(self._subscription)

    def take(self) -> bytes | None:
        """Take the next message; None if there is none."""
        taken = take_serialized(self.handle, self._type)
        return None if taken is None else taken[0]

    def take_with_info(self) -> Received | None:
        """Take the next message with its time and number; None if there is none."""
        taken = take_serialized(self.handle, self._type)
        if taken is None:
            return None
        data, info = taken
        sequence = info["publication_sequence_number"]
        return Received(data, info["source_timestamp"], 0 if sequence == NOT_COUNTED else sequence)


# /simulation/paused tells all nodes of a pause, so that watchdogs ignore it.


class PausedOutput:
    """Publisher of the pause, latched for late subscribers."""

    def __init__(self, node: Node) -> None:
        self._publisher = RawPublisher(node, topics.SIMULATION_PAUSED)
        self._published: bool | None = None

    def tell(self, is_paused: bool) -> None:
        """Publish whether the simulation is paused, if this has changed."""
        if is_paused is not self._published:
            self._published = is_paused
            self._publisher.publish(serialize_message(Bool(data=is_paused)))


class PausedInput:
    """Subscriber to the pause of the simulation."""

    def __init__(self, node: Node) -> None:
        self._input = RawSubscription(node, topics.SIMULATION_PAUSED, PolledCallbackGroup())
        self._is_paused = False
        self._heard_at = time.monotonic()

    @property
    def running_since(self) -> float:
        """Time since which the simulation is known to be running, monotonic clock.

        During a pause it is the present time.
        """
        while (data := self._input.take()) is not None:
            try:
                self._is_paused = bool(decode(data, topics.SIMULATION_PAUSED.type).data)
            except MessageError:
                continue
            self._heard_at = time.monotonic()
        return time.monotonic() if self._is_paused else self._heard_at
