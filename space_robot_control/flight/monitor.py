"""Following a flight from outside, on the topics any tool can read."""

from __future__ import annotations

import os

from space_robot_msgs_py import topics
from space_robot_msgs_py.codecs import TelemetryCodec
from space_robot_msgs_py.ros.process_environment import set_defaults


class Monitor:
    """Simulated time from /clock and current errors from /controller/telemetry."""

    def __init__(self, domain: int) -> None:
        set_defaults()
        import rclpy
        from rclpy.context import Context
        from rclpy.signals import SignalHandlerOptions

        from space_robot_msgs_py.ros.endpoints import In, TakenByLoop

        self._context = Context()
        rclpy.init(
            args=[], context=self._context, domain_id=domain,
            signal_handler_options=SignalHandlerOptions.NO,
        )  # fmt: skip
        self._node = rclpy.create_node(
            f"flight_monitor_{os.getpid()}", context=self._context,
            start_parameter_services=False, enable_rosout=False,
        )  # fmt: skip
        group = TakenByLoop()
        self._clock = In(self._node, topics.CLOCK, group, depth=1)
        self._telemetry = In(self._node, topics.TELEMETRY, group, depth=1)
        self.simulated_s = 0.0
        self.has_begun = False
        """Whether the plant has sent a tick."""
        self.errors: tuple[float, float] | None = None
        """Largest current attitude error (eps) and joint error (rad)."""

    def poll(self) -> None:
        """Take the newest messages."""
        from space_robot_msgs_py.cdr import header_stamp_ns

        while (data := self._clock.take()) is not None:
            self.simulated_s, self.has_begun = header_stamp_ns(data) / 1e9, True
        while (data := self._telemetry.take()) is not None:
            _, rows = TelemetryCodec.decode(data)
            error = abs(rows[TelemetryCodec.ROWS.index("e")])
            self.errors = float(error[:3].max()), float(error[3:].max())

    def close(self) -> None:
        """Leave the graph."""
        self._node.destroy_node()
        self._context.try_shutdown()
