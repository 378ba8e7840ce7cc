"""Service calls of a node, executed one by one between the ticks of its loop."""

from __future__ import annotations

import time
import types
from collections.abc import Callable, Generator
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ShutdownException, SingleThreadedExecutor, TimeoutException
from rclpy.node import Node

from ..errors import FlightError
from .rclpy_internals import ServiceWaitSet

FULL_CHECK_S = 5.0
FIND_S = 5.0
ANSWER_S = 180.0
"""Timeout of a transition, in which a node may compile code."""


class ServiceCalls(SingleThreadedExecutor):
    """Executes the callbacks of one node, and counts them."""

    def __init__(self, node: Node) -> None:
        super().__init__()
        self.add_node(node)
        self._requests = ServiceWaitSet(node)
        self._full_check_at = 0.0
        """Time of the next check of all entities, including the middleware's events."""
        self.count = 0
        """Number of executed calls."""
        self._unfinished: list[Any] = []
        """Calls whose callback waits for the node's loop."""
        self._own_tasks: list[Any] = []
        """Unfinished tasks of rclpy, such as those of an action's goals and results."""

    def run_one(self, timeout_s: float = 0.0) -> bool:
        """Execute a call that waits or arrives in time; return True if there was one."""
        if not timeout_s and not self._may_be_called():
            return False
        # the end of a call wakes the executor, so its next wait returns at once without result
        callback = self._next(timeout_s) or self._next(0.0)
        if callback is None:
            return False
        callback()
        if callback in self._unfinished:
            self._unfinished.remove(callback)
        else:
            self.count += 1
        if not callback.done():
            self._unfinished.append(callback)
        elif error := callback.exception():
            raise error
        return True

    def create_task(self, callback: Any, *args: Any, **kwargs: Any) -> Any:
        """Execute a callback by one of the next calls of `run_one`."""
        self._own_tasks.append(super().create_task(callback, *args, **kwargs))
        return self._own_tasks[-1]

    def finish(self) -> None:
        """Resume all waiting callbacks after the end of the loop."""
        for callback in self._unfinished:
            callback()

    def _may_be_called(self) -> bool:
        self._own_tasks = [task for task in self._own_tasks if not task.done()]
        if self._unfinished or self._own_tasks:
            return True
        if (now := time.monotonic()) < self._full_check_at:
            return self._requests.is_called()
        self._full_check_at = now + FULL_CHECK_S
        return True

    def _next(self, timeout_s: float) -> Any:
        try:
            return self.wait_for_ready_callbacks(timeout_sec=timeout_s)[0]
        except (TimeoutException, ShutdownException):
            return None


@types.coroutine
def until(condition: Callable[[], bool]) -> Generator[None, None, None]:
    """Yield to the node until a condition holds; for service callbacks."""
    while not condition():
        yield


async def change_state(node: Node, name: str, transition: str) -> None:
    """Request a lifecycle transition of the node ``name``, from within a service callback.

    Raises:
        FlightError: the other node refuses or does not answer.
    """
    # the answer comes while the callback that waits for it has not returned
    client = node.create_client(
        ChangeState, f"{name}/change_state", callback_group=ReentrantCallbackGroup()
    )
    try:
        await _in_time(client.service_is_ready, FIND_S, f"{name} is not available to {transition}")
        number = getattr(Transition, f"TRANSITION_{transition.upper()}")
        answer = client.call_async(ChangeState.Request(transition=Transition(id=number)))
        await _in_time(answer.done, ANSWER_S, f"{name} does not answer to {transition}")
        if not answer.result().success:
            raise FlightError(f"{name} refuses to {transition}: see its log")
    finally:
        node.destroy_client(client)


async def _in_time(condition: Callable[[], bool], seconds: float, complaint: str) -> None:
    deadline = time.monotonic() + seconds
    await until(lambda: condition() or time.monotonic() > deadline)
    if not condition():
        raise FlightError(complaint)
