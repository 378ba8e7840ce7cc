"""A node of this project as a ROS 2 lifecycle node.

Files and parameters are checked by configure, which fails with the reason; topics exist after it
has succeeded. Nothing is sent before activate.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Generic, TypeVar

from rcl_interfaces.msg import ParameterDescriptor, ParameterType
from rclpy.lifecycle import LifecycleNode, LifecycleState, TransitionCallbackReturn

from ..config.settings import NodeSettings
from ..errors import InputError, SpaceRobotError
from ..samples import Timebase
from .diagnostics import Diagnostics
from .exclusive import TopicClaim, claim_name, foreign_publishers
from .health import SENT, Health, Level
from .locks import FileLock
from .loop import Loop
from .parameters import declare_settings, refuse_unknown
from .rclpy_internals import declared_parameters, forget_parameters, guard_change_state
from .service_calls import ServiceCalls

Schema = TypeVar("Schema", bound=NodeSettings)
AUTOSTART = "autostart"
DISCOVERY_S = 0.3
LOOK_AGAIN_S = 0.3
LOOK_PERIOD_S = 1.0
"""Period of checks for foreign publishers, which take as long as the rest of a report."""
PAUSE_S = 1e-3
NO_TIME = Timebase(1)
"""Timebase of a node that has never been configured: it is at tick 0."""


class ManagedNode(LifecycleNode, Generic[Schema]):
    """Lifecycle node that creates, starts, stops and closes a `Loop`."""

    def __init__(
        self,
        schema: type[Schema],
        make_loop: Callable[[ManagedNode[Schema], Schema], Loop],
        changeable: tuple[str, ...] = (),
        offer_services: Callable[[ManagedNode[Schema]], None] = lambda node: None,
    ) -> None:
        super().__init__(schema.ros_name())
        self._schema, self._make_loop, self._changeable = schema, make_loop, changeable
        self.settings: Schema | None = None
        self.loop: Loop | None = None
        self.is_active = False
        self.is_shut_down = False
        self.times_configured = 0
        """Number of successful configurations."""
        self.let_others_work: Callable[[], None] = lambda: time.sleep(PAUSE_S)
        """Called by a loop while it waits for another node during deactivation."""
        self._topics: list[str] = []
        self._foreign, self._look_at = "", 0.0
        """Last found foreign publishers, and time of the next check."""
        self._claim: TopicClaim | None = None
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
        offer_services(self)
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
        """Return the loop's health with the numbers of sent messages, for the recorder's check."""
        if self.loop is None:
            return Health("unconfigured")
        health = self.loop.health()
        sent = {f"{SENT}{output.full_name}": output.sent for output in self.loop.outputs}
        values = {**health.values, **sent, "service_calls": self.calls.count}
        if not self.is_active:
            return Health("inactive", values=values)
        if (now := time.monotonic()) >= self._look_at:
            self._look_at = now + LOOK_PERIOD_S
            self._foreign = self._foreign_publishers()
        if health.level is Level.OK and self._foreign:
            return Health(self._foreign, Level.WARN, values)
        if health.level is Level.OK and self.calls.is_overloaded:
            return Health("more service calls than can be answered in flight", Level.WARN, values)
        return Health(health.mode, health.level, values)

    def claim_name(self) -> None:
        """Claim the node's name in the domain, before any service is offered.

        Raises:
            InputError: another node of this project has the name.
        """
        self._name = claim_name(self)

    def destroy_node(self) -> None:
        """Release all resources, the executor before the node."""
        self.calls.shutdown()
        super().destroy_node()
        if self._name:
            self._name.release()

    def start(self) -> None:
        """Configure and activate.

        Raises:
            SpaceRobotError: the transition failed.
        """
        self._insist(self.trigger_configure())
        time.sleep(DISCOVERY_S)  # to discover other nodes
        self._insist(self.trigger_activate())

    def stop(self) -> None:
        """Deactivate and clean up, the reverse of `start`.

        Raises:
            SpaceRobotError: the transition failed.
        """
        self._insist(self.trigger_deactivate())
        self._insist(self.trigger_cleanup())

    def _insist(self, outcome: TransitionCallbackReturn) -> None:
        if outcome is not TransitionCallbackReturn.SUCCESS:
            raise self.error or SpaceRobotError(f"{self.get_name()} cannot be started")

    def end(self) -> None:
        """Shut down, unless already done, and release all resources.

        Raises:
            SpaceRobotError: the loop could not be closed properly.
        """
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
            self.settings = declare_settings(self, self._schema, self._changeable)
            if not self._changeable:  # otherwise the loop declares more parameters
                refuse_unknown(self)
            self.loop = self._make_loop(self, self.settings)
            refuse_unknown(self)
            self._topics = [output.topic.name for output in self.loop.outputs]
            own = {*self._topics, *(topic.name for topic in self._schema.sends)}
            self._claim = TopicClaim(self, sorted(own))  # claimed even if never published
            self.times_configured += 1

        return self._try(configure, undo=self._release)

    def on_activate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Start the loop, unless another node publishes this one's topics."""

        def activate() -> None:
            if foreign := self._lasting_foreign_publishers():
                raise InputError(foreign)
            self.is_active = True

        return self._try(activate)

    def on_deactivate(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Stop the loop."""
        return self._try(self._stand_down)

    def on_cleanup(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Remove topics and parameters; the next configure reads the files again."""
        return self._try(self._release)

    def on_shutdown(self, state: LifecycleState) -> TransitionCallbackReturn:
        """End the node, from any state."""

        def shut_down() -> None:
            self.is_shut_down = True
            self._stand_down()
            self._release()

        return self._try(shut_down)

    def on_error(self, state: LifecycleState) -> TransitionCallbackReturn:
        """Finalize the node after an unexpected error in a transition."""
        self.is_shut_down = True
        return TransitionCallbackReturn.FAILURE

    def _foreign_publishers(self) -> str:
        """Describe foreign publishers of this node's topics; empty if there are none."""
        crowded = [
            topic
            for topic in self._topics
            if self.count_publishers(self.resolve_topic_name(topic)) > 1
        ]
        foreign = foreign_publishers(self, crowded)
        return "; ".join(f"{t} is also published by {', '.join(n)}" for t, n in foreign.items())

    def _lasting_foreign_publishers(self) -> str:
        """Check twice for foreign publishers: discovery first shows them without node name."""
        if self._foreign_publishers():
            time.sleep(LOOK_AGAIN_S)
        return self._foreign_publishers()

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

    def _stand_down(self) -> None:
        if self.is_active and self.loop is not None:
            self.is_active = False
            self.loop.deactivate()

    def _release(self) -> None:
        """Close the loop, and destroy everything created by configure."""
        loop, self.loop = self.loop, None
        try:
            if loop is not None:
                loop.close()
        finally:
            if self._claim:
                self._claim.release()
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
