"""The wait for a controller that others start, and its end."""

from __future__ import annotations

import time
from collections.abc import Mapping

from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.ros.endpoints import RawSubscription, full_name_of
from space_robot_msgs_py.ros.managed_node import ManagedNode

from .settings import PlantNodeSettings

DISCOVERY_S = 2.0
"""Until all nodes have discovered one that has just been discovered by one of them (measured with
Fast DDS of Jazzy: 0.1 to 1.8 s). The recorder would miss commands sent before."""


class OwnController:
    """Decides whether a plant waits for a controller, and when it gives it up."""

    def __init__(
        self,
        node: ManagedNode[PlantNodeSettings],
        command: RawSubscription,
        settings: PlantNodeSettings,
    ) -> None:
        """``command``: the plant's subscription to what the controller publishes."""
        self._node, self._topic, self._settings = node, command.full_name, settings
        self.is_missing = settings.own_controller
        """True until there is a controller."""
        self._since = self._discovered_at = 0.0

    def is_awaited(self) -> bool:
        """Return whether the first state must wait for the controller.

        Raises:
            FlightError: none has come in time.
        """
        if not self.is_missing:
            return False
        now = time.monotonic()
        self._since = self._since or now
        if not self._node.count_publishers(self._topic):
            self._discovered_at = 0.0
            self.check_first(now - self._since)
        else:
            self._discovered_at = self._discovered_at or now
            self.is_missing = now < self._discovered_at + DISCOVERY_S
        return self.is_missing

    def check_first(self, waited_s: float, refused: Mapping[str, int] | None = None) -> None:
        """Check that the first command is not overdue.

        Args:
            waited_s: time since it is awaited, s.
            refused: commands that were refused, by reason.

        Raises:
            FlightError: it is.
        """
        limit = self._settings.join_timeout
        if not limit or waited_s <= limit:
            return
        reasons = ", ".join(f"{reason} ({count})" for reason, count in (refused or {}).items())
        raise FlightError(
            f"no good command for tick 0 within {limit:g} s (join_timeout): {self._publishers()}"
            + (f"; refused: {reasons}" if reasons else "")
        )

    def check_silence(self, tick: int) -> None:
        """Check that a plant may fly on though its controller is silent.

        Raises:
            FlightError: it may not.
        """
        if self._settings.own_controller:
            raise FlightError(
                f"no command for {self._settings.silence_timeout:g} s (silence_timeout) at "
                f"{tick * self._settings.period:.4f} s: the controller is silent; "
                f"{self._publishers()}"
            )

    def _publishers(self) -> str:
        infos = self._node.get_publishers_info_by_topic(self._topic)
        names = ", ".join(sorted(map(full_name_of, infos))) or "none"
        domain = self._node.context.get_domain_id()
        return f"publishers of {self._topic} in ROS domain {domain}: {names}"
