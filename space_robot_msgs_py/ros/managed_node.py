"""A node of this project as a ROS 2 lifecycle node.

Files and parameters are checked by configure, which fails with the reason; topics exist after it
has succeeded. Nothing is sent before activate.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rcl_interfaces.msg import ParameterDescriptor, ParameterType
from rclpy.duration import Duration
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn
from rclpy.node import Node

from .. import topics
from ..config.settings import NodeSettings
from ..errors import InputError, SpaceRobotError
from ..samples import Timebase
from .locks import FileLock, HeldError, node_lock
from .loop import SENT, Health, Level, Loop
from .parameters import declare_settings, refuse_unknown
from .rclpy_internals import declared_parameters, forget_parameters, guard_change_state
from .service_calls import ServiceCalls, change_state

Schema = TypeVar("Schema", bound=NodeSettings)
REPORT_S = 1.0
FLUSH_S = 0.5
AUTOSTART = "autostart"
PAUSE_S = 1e-3
NO_TIME = Timebase(1)
"""Timebase of a node that has never been configured: it is at tick 0."""


@dataclass(frozen=True)
class NodeKind(Generic[Schema]):
    """Definition of a kind of node."""

    schema: type[Schema]
    """Schema of its parameters, with the node's name."""
    make_loop: Callable[[ManagedNode[Schema], Schema], Loop]
    changeable: tuple[str, ...] = ()
    """Names of the parameters that can be changed in flight."""
    offer_services: Callable[[ManagedNode[Schema]], None] = lambda node: None
    """Creates services and parameters that exist in all lifecycle states."""


class ManagedNode(LifecycleNode, Generic[Schema]):
    """Lifecycle node that creates, starts, stops and closes a `Loop`."""

    def __init__(self, kind: NodeKind[Schema]) -> None:
        """Create the node in the state unconfigured."""
        super().__init__(kind.schema.ros_name())
        self._kind = kind
        self.settings: Schema | None = None
        self.loop: Loop | None = None
        self.is_active = False
        self.is_shut_down = False
        self.times_configured = 0
        """Number of successful configurations."""
        self.let_others_work: Callable[[], None] = lambda: time.sleep(PAUSE_S)
        """Called by a loop while it waits for another node during deactivation."""
        self._name: FileLock | None = None
        self.error: SpaceRobotError | None = None
        """Reason why the last transition failed."""
        description = ParameterDescriptor(
            description="configure and activate at startup (false: wait for transitions)",
            read_only=True,
        )
        self.autostart = bool(self.declare_parameter(AUTOSTART, True, description).value)
        no_effect = ParameterDescriptor(
            type=ParameterType.PARAMETER_BOOL,
            description="without effect: the time of the nodes is that of the plant's states",
            read_only=True,
        )
        self.set_descriptor("use_sim_time", no_effect)
        self._diagnostics = Diagnostics(self)
        kind.offer_services(self)
        self._own = self._entities()
        self.calls = ServiceCalls(self)
        guard_change_state(self, self._refuse_transition)

    def log(self, text: str) -> None:
        """Write to the node's log."""
        self.get_logger().info(text)

    def report(self) -> None:
        """Report the health if it is due, or if the mode has changed."""
        self._diagnostics.report(self._health(), self._timebase)

    @property
    def _timebase(self) -> Timebase:
        return self.settings.timebase if self.settings else NO_TIME

    def _health(self) -> Health:
        if self.loop is None:
            return Health("unconfigured")
        health = self.loop.health()
        # the recorder compares these numbers with those of the messages that it received
        sent = {f"{SENT}{output.full_name}": output.sent for output in self.loop.outputs}
        values = {**health.values, **sent, "service_calls": self.calls.count}
        if not self.is_active:
            return Health("inactive", values=values)
        return Health(health.mode, health.level, values)

    def claim_name(self) -> None:
        """Claim the node's name, so that service calls by name reach one node only."""
        domain, name = self.context.get_domain_id(), self.get_fully_qualified_name()
        try:
            self._name = FileLock(node_lock(domain, name), self.get_name())
        except HeldError as error:
            raise InputError(
                f"ROS domain {domain} has a {name} already: {error.holder.name}; end that one, "
                "or use another domain (ROS_DOMAIN_ID) or name (--ros-args -r __node:=...)"
            ) from None

    def destroy_node(self) -> None:
        """Release all resources, the executor before the node."""
        self.calls.shutdown()
        super().destroy_node()
        if self._name:
            self._name.release()

    def start(self) -> None:
        """Configure and activate; a `SpaceRobotError` says why that failed."""
        self._insist(self.trigger_configure())
        self._insist(self.trigger_activate())

    def stop(self) -> None:
        """Deactivate and clean up; a `SpaceRobotError` says why that failed."""
        self._insist(self.trigger_deactivate())
        self._insist(self.trigger_cleanup())

    async def restart(self, others: Sequence[str]) -> None:
        """Deactivate and clean up this node and others, then configure and activate all again.

        They read their parameters and files again, as at their first start. To be awaited by a
        service callback.

        Args:
            others: names of the others in its namespace, in the order of activation.

        Raises:
            FlightError: a node refuses or does not answer; the flight then stops.
            SpaceRobotError: this node itself cannot be started.
        """
        self.stop()
        for transition in ("deactivate", "cleanup"):
            for name in reversed(others):
                await change_state(self, name, transition)
        for transition in ("configure", "activate"):
            for name in others:
                await change_state(self, name, transition)
        self.start()

    def _insist(self, outcome: TransitionCallbackReturn) -> None:
        if outcome is not TransitionCallbackReturn.SUCCESS:
            raise self.error or SpaceRobotError(f"{self.get_name()} cannot be started")

    def end(self) -> None:
        """Shut down, unless already done, and release all resources."""
        if self.is_shut_down:
            self._try(self._release)
        else:
            if self.loop is not None and self.is_active:
                self._diagnostics.report(self._health(), self._timebase, now_or_never=True)
            self.trigger_shutdown()
        self.calls.finish()
        if self.error:
            raise self.error

    def on_configure(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Check parameters and files, create the loop and its topics."""

        def configure() -> None:
            kind = self._kind
            self.settings = declare_settings(self, kind.schema, kind.changeable)
            if not kind.changeable:  # otherwise the loop declares more parameters
                refuse_unknown(self)
            self.loop = kind.make_loop(self, self.settings)
            refuse_unknown(self)
            self.times_configured += 1

        return self._try(configure, undo=self._release)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Let the scheduler start the loop, once its subscribers are there."""
        self.is_active = True
        return TransitionCallbackReturn.SUCCESS

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the loop."""
        return self._try(self._deactivate)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Remove topics and parameters; the next configure reads the files again."""
        return self._try(self._release)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the node, from any state."""

        def shut_down() -> None:
            self.is_shut_down = True
            self._deactivate()
            self._release()

        return self._try(shut_down)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Finalize the node after an unexpected error in a transition."""
        self.is_shut_down = True
        return TransitionCallbackReturn.FAILURE

    def _try(
        self, action: Callable[[], None], undo: Callable[[], None] | None = None
    ) -> TransitionCallbackReturn:
        self.error = None
        try:
            action()
        except SpaceRobotError as error:
            self.error = error
            if undo:
                undo()
            if not self.autostart:  # otherwise the process ends with this message
                self.get_logger().error(str(error))
            return TransitionCallbackReturn.FAILURE
        except Exception as error:  # rclpy would ignore it silently
            self.error = SpaceRobotError(f"unexpected {type(error).__name__}: {error}")
            self.get_logger().error(str(self.error))
            return TransitionCallbackReturn.ERROR
        return TransitionCallbackReturn.SUCCESS

    def _deactivate(self) -> None:
        if self.is_active and self.loop is not None:
            self.is_active = False
            self.loop.deactivate()

    def _release(self) -> None:
        loop, self.loop = self.loop, None
        try:
            if loop is not None:
                loop.close()
        finally:
            # all that was created since the constructor: the next configuration creates it anew
            publishers, subscriptions, parameters = self._entities()
            for publisher in publishers - self._own[0]:
                self.destroy_publisher(publisher)
            for subscription in subscriptions - self._own[1]:
                self.destroy_subscription(subscription)
            forget_parameters(self, parameters - self._own[2])

    def _entities(self) -> tuple[set[Any], set[Any], set[str]]:
        return set(self.publishers), set(self.subscriptions), declared_parameters(self)

    def _refuse_transition(self) -> None:
        self.error = InputError("this transition is not possible in the present state")
        self.get_logger().error(str(self.error))


class Diagnostics:
    """Publishes the health of a node on /diagnostics: each second, and at every change of mode.

    Stamps are simulated times, as on all other topics.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self._publisher = node.create_publisher(DiagnosticArray, topics.DIAGNOSTICS.name, 10)
        self._last: Health | None = None
        self._last_s = -REPORT_S
        self._last_tick: tuple[float, float] | None = None

    def report(self, health: Health, timebase: Timebase, now_or_never: bool = False) -> None:
        """Publish if a second has passed or the mode has changed.

        Args:
            health: its value ``tick``, by default 0, gives the message's stamp.
            timebase: conversion between ticks and stamps.
            now_or_never: True for the last report: publish always, and wait for delivery.
        """
        now = time.monotonic()
        changed = self._last is None or (health.mode, health.level) != (
            self._last.mode,
            self._last.level,
        )
        if not (changed or now_or_never) and now - self._last_s < REPORT_S:
            return
        if changed:
            if health.level is Level.OK:  # two lines: rclpy allows one severity per calling line
                self._node.get_logger().info(health.mode)
            else:
                self._node.get_logger().warning(health.mode)
        values = {**health.values, **self._rate(health, now)}
        self._last, self._last_s = health, now
        status = DiagnosticStatus(
            level=bytes([health.level]),
            name=self._node.get_fully_qualified_name().lstrip("/"),
            message=health.mode,
            hardware_id="space_robot",
            values=[KeyValue(key=key, value=_text(value)) for key, value in values.items()],
        )
        message = DiagnosticArray(status=[status])
        tick = health.values.get("tick", 0)
        seconds, rest_ns = divmod(timebase.stamp_ns(max(0, int(tick))), 1_000_000_000)
        message.header.stamp.sec, message.header.stamp.nanosec = seconds, rest_ns
        self._publisher.publish(message)
        if now_or_never:
            self._publisher.wait_for_all_acked(Duration(seconds=FLUSH_S))

    def _rate(self, health: Health, now: float) -> dict[str, float]:
        tick = health.values.get("tick")
        if not isinstance(tick, int):
            return {}
        last, self._last_tick = self._last_tick, (tick, now)
        if last is None or now <= last[1]:
            return {}
        return {"rate_hz": (tick - last[0]) / (now - last[1])}


def _text(value: float | str) -> str:
    return f"{value:.6g}" if isinstance(value, float) else str(value)
