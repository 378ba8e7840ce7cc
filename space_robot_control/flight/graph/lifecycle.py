"""Driving the lifecycle of the nodes: configure all, then activate them in their order."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from space_robot_msgs_py.errors import FlightError

TIMEOUT_S = 60.0
POLL_S = 0.02


class LifecycleDriver:
    """Calls the nodes' ``change_state`` services."""

    def __init__(self, node: Any) -> None:
        """``node``: the rclpy node to call from."""
        from lifecycle_msgs.srv import ChangeState
        from rclpy.executors import SingleThreadedExecutor

        self._node, self._type = node, ChangeState
        self._executor = SingleThreadedExecutor(context=node.context)
        self._executor.add_node(node)

    def change(self, names: Sequence[str], transition: str, check: Callable[[], None]) -> list[str]:
        """Put the named nodes through ``configure`` or ``activate``, all at once.

        Args:
            names: ROS names of the nodes.
            transition: its label.
            check: called while waiting; raises to give up.

        Returns:
            The nodes that refused.

        Raises:
            FlightError: a node does not answer.
        """
        from lifecycle_msgs.msg import Transition

        number = getattr(Transition, f"TRANSITION_{transition.upper()}")
        clients = {n: self._node.create_client(self._type, f"/{n}/change_state") for n in names}
        request = self._type.Request(transition=Transition(id=number))
        answers: dict[str, Any] = {}

        def all_have_answered() -> bool:
            for name, client in clients.items():
                if name not in answers and client.service_is_ready():
                    answers[name] = client.call_async(request)
            return len(answers) == len(names) and all(a.done() for a in answers.values())

        try:
            self._wait(all_have_answered, check)
            return [name for name, answer in answers.items() if not answer.result().success]
        finally:
            for client in clients.values():
                self._node.destroy_client(client)

    def close(self) -> None:
        """Let go of the node."""
        self._executor.shutdown()

    def _wait(self, done: Callable[[], bool], check: Callable[[], None]) -> None:
        until = time.monotonic() + TIMEOUT_S
        while not done():
            check()
            if time.monotonic() > until:
                raise FlightError(f"the nodes' lifecycle services do not answer for {TIMEOUT_S} s")
            self._executor.spin_once(timeout_sec=POLL_S)
