"""Restart of a graph of lifecycle nodes, from within one of its nodes."""

from __future__ import annotations

import time
import types
from collections.abc import Callable, Generator, Sequence
from typing import Any

from lifecycle_msgs.msg import Transition
from lifecycle_msgs.srv import ChangeState
from rclpy.callback_groups import ReentrantCallbackGroup

from ..errors import FlightError
from .managed_node import ManagedNode

FIND_S = 5.0
ANSWER_S = 180.0
"""Timeout of a transition, in which a node may compile code."""


@types.coroutine
def until(condition: Callable[[], bool]) -> Generator[None, None, None]:
    """Yield to the node until a condition holds; for service callbacks."""
    while not condition():
        yield


async def restart(node: ManagedNode[Any], others: Sequence[str]) -> None:
    """Deactivate and clean up a node and others, then configure and activate them again.

    They read their parameters and files again, as at their first start.

    Args:
        node: the leading node, which stops first and starts last.
        others: names of the others in its namespace, in the order of activation.

    Raises:
        FlightError: a node refuses or does not answer; the flight then stops.
        SpaceRobotError: ``node`` itself cannot be started.
    """
    node.stop()
    for transition in ("deactivate", "cleanup"):
        for name in reversed(others):
            await _change(node, name, transition)
    for transition in ("configure", "activate"):
        for name in others:
            await _change(node, name, transition)
    node.start()


async def _change(node: ManagedNode[Any], name: str, transition: str) -> None:
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
