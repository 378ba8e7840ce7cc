"""A node of the test beside those of the graph, which calls services and hears and sends."""

from __future__ import annotations

import os
import signal
import subprocess
import time
from collections.abc import Callable
from typing import Any

from space_robot_msgs_py.ros.process import set_defaults

set_defaults()

import rclpy  # noqa: E402
from lifecycle_msgs.msg import Transition  # noqa: E402
from lifecycle_msgs.srv import ChangeState, GetState  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402

from space_robot.flight.graph.monitor import Monitor  # noqa: E402
from space_robot.flight.graph.node_services import change_state  # noqa: E402

TIMEOUT_S, AGAIN_S = 240.0, 30.0


def request(transition: str) -> Any:
    number = getattr(Transition, f"TRANSITION_{transition.upper()}")
    return ChangeState.Request(transition=Transition(id=number))


class Ground:
    """A node of the test that calls services, and hears and sends what it likes."""

    def __init__(self, domain: int) -> None:
        self.context = rclpy.Context()
        rclpy.init(args=[], context=self.context, domain_id=domain)
        self.node = rclpy.create_node(f"ground_{os.getpid()}", context=self.context)
        self._executor = SingleThreadedExecutor(context=self.context)
        self._executor.add_node(self.node)
        self.monitor = Monitor(domain)

    def close(self) -> None:
        self.monitor.close()
        self.node.destroy_node()
        self.context.try_shutdown()

    def call(self, service: Any, name: str, request: Any) -> Any:
        client = self.node.create_client(service, name)
        try:
            assert client.wait_for_service(TIMEOUT_S), name
            for _ in range(round(TIMEOUT_S / AGAIN_S)):  # an answer may be lost
                future = client.call_async(request)
                self._executor.spin_until_future_complete(future, AGAIN_S)
                if future.done():
                    return future.result()
            raise AssertionError(name)
        finally:
            self.node.destroy_client(client)

    def change(self, node: str, transition: str) -> bool:
        refused = change_state(self.node, [f"{node}_node"], transition, lambda: None)
        self._executor.add_node(self.node)
        return not refused

    def change_at_once(
        self, node: str, process: subprocess.Popen[str], *transitions: str
    ) -> list[bool]:
        """Ask for several transitions that a node finds together when it looks."""
        client = self.node.create_client(ChangeState, f"/{node}_node/change_state")
        assert client.wait_for_service(TIMEOUT_S), node
        process.send_signal(signal.SIGSTOP)
        futures = [client.call_async(request(transition)) for transition in transitions]
        time.sleep(0.1)
        process.send_signal(signal.SIGCONT)
        for future in futures:
            self._executor.spin_until_future_complete(future, TIMEOUT_S)
        self.node.destroy_client(client)
        return [future.done() and bool(future.result().success) for future in futures]

    def state(self, node: str) -> str:
        answer = self.call(GetState, f"/{node}_node/get_state", GetState.Request())
        return str(answer.current_state.label)

    def value(self, node: str, key: str) -> float:
        return float(self.monitor.values.get(f"{node}_node", {}).get(key, 0))

    def until(self, done: Callable[[], bool], what: str) -> None:
        until = time.monotonic() + TIMEOUT_S
        while not done():
            assert time.monotonic() < until, (what, self.monitor.values)
            self.monitor.poll()
            time.sleep(0.01)
