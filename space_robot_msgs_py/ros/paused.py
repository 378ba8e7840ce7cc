"""/simulation/paused: tells all nodes of a pause, so that watchdogs ignore it."""

from __future__ import annotations

import time

from rclpy.node import Node
from rclpy.serialization import serialize_message
from std_msgs.msg import Bool

from .. import topics
from ..errors import MessageError
from ..wire.definitions import decode
from .endpoints import PolledCallbackGroup, RawPublisher, RawSubscription


class PausedOutput:
    """Publisher of the pause, latched for late subscribers."""

    def __init__(self, node: Node) -> None:
        self._publisher = RawPublisher(node, topics.SIMULATION_PAUSED)
        self._told: bool | None = None

    def tell(self, is_paused: bool) -> None:
        """Publish whether the simulation is paused, if this has changed."""
        if is_paused is not self._told:
            self._told = is_paused
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
