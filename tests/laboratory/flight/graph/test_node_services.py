"""Calls of services are made once, when the answer will arrive."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from typing import Any

import pytest

from space_robot_msgs_py.ros.process_environment import set_defaults

set_defaults()
rclpy = pytest.importorskip("rclpy")

from lifecycle_msgs.srv import GetState  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

from space_robot.flight.graph import node_services  # noqa: E402
from space_robot.flight.graph.temporary_node import TemporaryNode  # noqa: E402

UNHEARD = 2
"""So many answers are dropped, as to a client that has not been discovered."""


class Server:
    """A node whose first answers do not arrive, whatever the service."""

    def __init__(self, domain: int) -> None:
        self._visitor = TemporaryNode("plant_node", domain)
        self.node = self._visitor.node
        self.answers = self.triggers = 0
        for kind, name, callback in (
            (GetState, "get_state", self._get_state),
            (Trigger, "go", self._go),
        ):
            service = self.node.create_service(kind, f"{self.node.get_name()}/{name}", callback)
            service.send_response = self._dropping(service.send_response)
        self._executor = SingleThreadedExecutor(context=self.node.context)
        self._executor.add_node(self.node)
        self._is_over = False
        self._thread = threading.Thread(target=self._spin)
        self._thread.start()

    def _spin(self) -> None:
        while not self._is_over:
            self._executor.spin_once(timeout_sec=0.02)

    def _dropping(self, send: Any) -> Any:
        def send_or_drop(response: Any, header: Any) -> None:
            self.answers += 1
            if self.answers > UNHEARD:
                send(response, header)

        return send_or_drop

    def _get_state(self, request: Any, response: Any) -> Any:
        return response

    def _go(self, request: Any, response: Any) -> Any:
        self.triggers += 1
        response.success, response.message = True, "goes on"
        return response

    def close(self) -> None:
        self._is_over = True
        self._thread.join()
        self._executor.shutdown()
        self._visitor.leave()


@pytest.fixture
def server(domain: int) -> Iterator[Server]:
    it = Server(domain)
    yield it
    it.close()


def test_an_answer_that_is_lost_to_a_new_caller_delays_the_call_and_no_more(
    server: Server, domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(node_services, "ASK_AGAIN_S", 0.2)
    caller = TemporaryNode("caller", domain)
    try:
        said = node_services.call_trigger(caller.node, f"{server.node.get_name()}/go", lambda: None)
    finally:
        caller.leave()
    assert said == (True, "goes on")
    assert server.triggers == 1, "what is not asked twice, as a step, is not done twice"
    assert server.answers > UNHEARD + 1
