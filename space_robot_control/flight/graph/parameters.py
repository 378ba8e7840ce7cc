"""Setting parameters of a live node, as ``ros2 param set`` does."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

from space_robot_msgs_py.errors import FlightError

TIMEOUT_S = 30.0
POLL_S = 0.02


class ParameterClient:
    """Calls a node's ``set_parameters_atomically`` service."""

    def __init__(self, node: Any, name: str, check: Callable[[], None]) -> None:
        """Make the client.

        Args:
            node: the rclpy node to call from.
            name: ROS name of the node whose parameters are to be set.
            check: called while waiting; raises to give up.
        """
        from rcl_interfaces.srv import SetParametersAtomically

        self._node, self._name, self._check = node, name, check
        self._request = SetParametersAtomically.Request
        self._client = node.create_client(
            SetParametersAtomically, f"/{name}/set_parameters_atomically"
        )

    def set(self, parameters: Mapping[str, str | list[float]]) -> None:
        """Set all of them or, if one is refused, none; return when the node has done so.

        Raises:
            FlightError: the node refuses, or does not answer.
        """
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.parameter import Parameter

        if not parameters:
            return
        make: Any = Parameter
        request = self._request(
            parameters=[make(n, value=v).to_parameter_msg() for n, v in parameters.items()]
        )
        executor = SingleThreadedExecutor(context=self._node.context)
        executor.add_node(self._node)  # and away from any other
        try:
            self._wait(executor, self._client.service_is_ready)
            answer = self._client.call_async(request)
            self._wait(executor, answer.done)
        finally:
            executor.shutdown()
        if not (result := answer.result().result).successful:
            raise FlightError(f"{self._name} refused to change its parameters: {result.reason}")

    def close(self) -> None:
        """Let go of the node."""
        self._node.destroy_client(self._client)

    def _wait(self, executor: Any, done: Callable[[], bool]) -> None:
        until = time.monotonic() + TIMEOUT_S
        while not done():
            self._check()
            if time.monotonic() > until:
                raise FlightError(
                    f"{self._name} does not answer for {TIMEOUT_S:.0f} s when told to change its "
                    "parameters"
                )
            executor.spin_once(timeout_sec=POLL_S)
