"""Temporary node of a command in the graph that it started."""

from __future__ import annotations

import os

from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.ros.process import set_defaults
from space_robot_msgs_py.topics import ROOT


def own_name(name: str) -> str:
    """Return the name of this process's node of a ``name``."""
    return f"{name}_{os.getpid()}"


class TemporaryNode:
    """Node ``<name>_<pid>`` in a domain, without services or logs."""

    def __init__(self, name: str, domain: int, namespace: str = ROOT) -> None:
        """Join.

        Raises:
            FlightError: ROS does not start, as without a folder for its log files.
        """
        set_defaults()
        import rclpy
        from rclpy.context import Context
        from rclpy.signals import SignalHandlerOptions

        self._context = Context()
        try:
            rclpy.init(
                args=[],
                context=self._context,
                domain_id=domain,
                signal_handler_options=SignalHandlerOptions.NO,
            )
        except Exception as error:  # RCLError is private
            raise FlightError(f"ROS does not start: {str(error).splitlines()[0]}") from None
        self.node = rclpy.create_node(
            own_name(name),
            context=self._context,
            namespace=namespace,
            start_parameter_services=False,
            enable_rosout=False,
        )

    def leave(self) -> None:
        """Leave the graph."""
        self.node.destroy_node()
        self._context.try_shutdown()
