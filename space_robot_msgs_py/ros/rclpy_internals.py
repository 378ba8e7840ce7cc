"""Access to private parts of rclpy, of the `VERSIONS` 7.1 of ROS 2 Jazzy.

What is used, and for want of which public way: wait sets (the executor's own costs more than a
loop's whole work), messages taken by hand, the parameters that the user gave for a node,
undeclaring read-only parameters, and a lifecycle node that survives an impossible transition.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from importlib import metadata
from typing import Any

from rclpy.context import Context
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.publisher import Publisher

VERSIONS = ("7.",)
"""Beginnings of rclpy's versions that this was written for: Jazzy's."""


def is_known_version() -> bool:
    """Return whether rclpy is one of `VERSIONS`, with its rcl and rmw."""
    try:
        return metadata.version("rclpy").startswith(VERSIONS)
    except metadata.PackageNotFoundError:
        return False


def tells_pointers() -> bool:
    """Return whether `pointer` works here."""
    return hasattr(_rclpy.Subscription, "pointer")


def pointer(handle: Any) -> int:
    """Address of the ``rcl_subscription_t`` behind a subscription's handle."""
    return handle.pointer  # type: ignore[no-any-return]


def take_serialized(handle: Any, message_type: Any) -> tuple[bytes, dict[str, int]] | None:
    """Take a subscription's next message, by its handle, with its info: rclpy's own take.

    Without rclpy's guard against another thread that destroys the subscription meanwhile.
    """
    taken: tuple[bytes, dict[str, int]] | None = handle.take_message(message_type, True)
    return taken


def raw_publish(publisher: Publisher) -> Callable[[bytes], None]:
    """The publisher's function for serialized messages; see `take_serialized` for its guard."""
    publish: Callable[[bytes], None] = publisher.handle.publish_raw
    return publish


class SubscriptionWaitSet:
    """A wait set for a fixed number of subscriptions."""

    def __init__(self, context: Context, size: int) -> None:
        handle: Any = context.handle
        with handle:
            self._set = _rclpy.WaitSet(size, 0, 0, 0, 0, 0, handle)

    def wait(self, handles: Sequence[Any], timeout_s: float) -> None:
        """Sleep until one of the subscriptions has a message or the time is over."""
        self._set.clear_entities()
        for handle in handles:
            self._set.add_subscription(handle)
        self._set.wait(max(1, int(timeout_s * 1e9)))


class ServiceWaitSet:
    """A wait set for all services of a node."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._services: list[Any] = []
        self._set: Any = None

    def is_called(self) -> bool:
        """Tell at once whether a request waits: in 20 us, where an executor's look takes 1 ms."""
        if (services := list(self._node.services)) != self._services:
            self._services = services
            handle: Any = self._node.context.handle
            with handle:
                self._set = _rclpy.WaitSet(0, 0, 0, 0, len(services), 0, handle)
        self._set.clear_entities()
        for service in services:
            self._set.add_service(service.handle)
        self._set.wait(0)
        return bool(self._set.get_ready_entities("service"))


def parameter_overrides(node: Node) -> Mapping[str, Any]:
    """Return what the user gave for a node, on the command line or in a parameter file."""
    return node._parameter_overrides


def declared_parameters(node: Node) -> set[str]:
    """Names of all declared parameters."""
    return set(node._parameters)


def forget_parameters(node: Node, names: Iterable[str]) -> None:
    """Undeclare parameters; ``undeclare_parameter`` refuses read-only ones."""
    for name in names:
        node._parameters.pop(name)
        node._descriptors.pop(name)


def guard_change_state(node: LifecycleNode, refused: Callable[[], None]) -> None:
    """Answer a transition that does not exist in the present state: rclpy would die of it.

    Args:
        node: not served yet.
        refused: called for each such transition.
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
