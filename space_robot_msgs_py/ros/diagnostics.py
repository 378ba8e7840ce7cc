"""/diagnostics: each node's `Health`, once per second and at every change of mode.

Stamps are simulated times, as on all other topics.
"""

from __future__ import annotations

import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rclpy.duration import Duration
from rclpy.node import Node

from .. import topics
from ..samples import Timebase
from .health import Health, Level

PERIOD_S = 1.0
FLUSH_S = 0.5


class Diagnostics:
    """Publishes the health of a node."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, topics.DIAGNOSTICS.name, 10)
        self._last: Health | None = None
        self._last_s = -PERIOD_S
        self._last_tick: tuple[float, float] | None = None

    def report(self, health: Health, timebase: Timebase, now_or_never: bool = False) -> None:
        """Publish if a second has passed or the mode has changed.

        Args:
            health: its value ``tick``, by default 0, gives the message's stamp.
            timebase: conversion between ticks and stamps.
            now_or_never: True for the last report: publish always, and wait for delivery.
        """
        now = time.monotonic()
        changed = self._last is None or (health.mode, health.level) != (
            self._last.mode,
            self._last.level,
        )
        if not (changed or now_or_never) and now - self._last_s < PERIOD_S:
            return
        if changed:
            if health.level is Level.OK:  # two lines: rclpy allows one severity per calling line
                self._node.get_logger().info(health.mode)
            else:
                self._node.get_logger().warning(health.mode)
        values = {**health.values, **self._rate(health, now)}
        self._last, self._last_s = health, now
        status = DiagnosticStatus(
            level=bytes([health.level]),
            name=self._node.get_fully_qualified_name().lstrip("/"),
            message=health.mode,
            hardware_id="space_robot",
            values=[KeyValue(key=key, value=_text(value)) for key, value in values.items()],
        )
        message = DiagnosticArray(status=[status])
        tick = health.values.get("tick", 0)
        seconds, rest_ns = divmod(timebase.stamp_ns(max(0, int(tick))), 1_000_000_000)
        message.header.stamp.sec, message.header.stamp.nanosec = seconds, rest_ns
        self._publisher.publish(message)
        if now_or_never:
            self._publisher.wait_for_all_acked(Duration(seconds=FLUSH_S))

    def _rate(self, health: Health, now: float) -> dict[str, float]:
        """Return the ticks per second of wall-clock time since the last report."""
        tick = health.values.get("tick")
        if not isinstance(tick, int):
            return {}
        last, self._last_tick = self._last_tick, (tick, now)
        if last is None or now <= last[1]:
            return {}
        return {"rate_hz": (tick - last[0]) / (now - last[1])}


def _text(value: float | str) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
