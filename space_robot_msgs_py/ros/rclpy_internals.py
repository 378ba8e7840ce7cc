"""Access to private parts of rclpy, of versions 7.x, those of ROS 2 Jazzy.

These have no public interface: wait sets (the executor's takes more time than a loop's work),
taking messages without executor, the user's parameters of a node, undeclaring read-only
parameters, and a lifecycle node that survives an impossible transition.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rclpy.context import Context
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.publisher import Publisher


def take_serialized(handle: Any, message_type: Any) -> tuple[bytes, dict[str, int]] | None:
    """Take a subscription's next message with its info by rclpy, from the handle.

    There is no protection against another thread that destroys the subscription meanwhile.
    """
    taken: tuple[bytes, dict[str, int]] | None = handle.take_message(message_type, True)
    return taken


def raw_publish(publisher: Publisher) -> Callable[[bytes], None]:
    """Return the publisher's function for serialized messages, without protection as above."""
    publish: Callable[[bytes], None] = publisher.handle.publish_raw
    return publish


class SubscriptionWaiter:
    """Waits until one of some subscriptions of a process has a message."""

    def __init__(self, context: Context) -> None:
        self._context: Any = context
        self._sets: dict[int, Any] = {}

    def wait(self, handles: Sequence[Any], timeout_s: float) -> None:
        """Sleep until there is a message for one of the handles, or until the timeout."""
        size = len(handles)
        if size not in self._sets:  # a wait set has room for a fixed number
            handle = self._context.handle
            with handle:
                self._sets[size] = _rclpy.WaitSet(size, 0, 0, 0, 0, 0, handle)
        waiting = self._sets[size]
        waiting.clear_entities()
        for handle in handles:
            waiting.add_subscription(handle)
        waiting.wait(max(1, int(timeout_s * 1e9)))


class ServiceWaitSet:
    """A wait set for all services and action servers of a node."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._entities: list[Any] = []
        self._actions: list[Any] = []
        self._set: Any = None

    def is_called(self) -> bool:
        """Return True if a request waits; takes 20 us, where an executor takes 1 ms."""
        if (entities := [*self._node.services, *self._node.waitables]) != self._entities:
            self._renew(entities)
        self._set.clear_entities()
        for service in self._node.services:
            self._set.add_service(service.handle)
        for action in self._actions:
            action.add_to_wait_set(self._set)
        self._set.wait(0)
        if self._set.get_ready_entities("service"):
            return True
        return any(action.is_ready(self._set) for action in self._actions)

    def _renew(self, entities: list[Any]) -> None:
        self._entities = entities
        handle: Any = self._node.context.handle
        self._actions = [w for w in self._node.waitables if w.get_num_entities().num_services]
        sizes = [action.get_num_entities() for action in self._actions]
        with handle:
            self._set = _rclpy.WaitSet(
                sum(size.num_subscriptions for size in sizes),
                sum(size.num_guard_conditions for size in sizes),
                sum(size.num_timers for size in sizes),
                sum(size.num_clients for size in sizes),
                len(list(self._node.services)) + sum(size.num_services for size in sizes),
                sum(size.num_events for size in sizes),
                handle,
            )


def parameter_overrides(node: Node) -> Mapping[str, Any]:
    """Return the user's parameters of a node, from the command line or a parameter file."""
    return node._parameter_overrides


def declared_parameters(node: Node) -> set[str]:
    """Return the names of all declared parameters."""
    return set(node._parameters)


def forget_parameters(node: Node, names: Iterable[str]) -> None:
    """Undeclare parameters; ``undeclare_parameter`` refuses read-only ones."""
    for name in names:
        node._parameters.pop(name)
        node._descriptors.pop(name)


def guard_change_state(node: LifecycleNode, refused: Callable[[], None]) -> None:
    """Refuse transitions that do not exist in the present state, on which rclpy would crash.

    ``refused`` is called for each. To be called before the node is in an executor.
    """
    service = node._service_change_state
    change_state = service.callback

    def guarded(request: Any, response: Any) -> Any:
        try:
            return change_state(request, response)
        except _rclpy.RCLError:
            response.success = False
            refused()
            return response

    service.callback = guarded
