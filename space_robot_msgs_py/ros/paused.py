"""/simulation/paused: publishes a pause to all nodes, so that watchdogs ignore it."""

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
    """Publisher of the pause, also for late subscribers."""

    def __init__(self, node: Node) -> None:
        self._publisher = RawPublisher(node, topics.SIMULATION_PAUSED)
        self._told: bool | None = None

    def tell(self, is_paused: bool) -> None:
        """Return whether the simulation is paused, if that is news."""
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
        """Time since when the simulation has been known not to be paused, by the monotonic clock.

        It is now while the simulation is paused.
        """
        while (data := self._input.take()) is not None:
            try:
                self._is_paused = bool(decode(data, topics.SIMULATION_PAUSED.type).data)
            except MessageError:
                continue
            self._heard_at = time.monotonic()
        return time.monotonic() if self._is_paused else self._heard_at
