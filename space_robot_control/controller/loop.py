"""The controller node's loop: answers every state with a command."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from space_robot_model.robot.find import find_robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.ros.endpoints import PausedInput, RawPublisher, flush
from space_robot_msgs_py.ros.loop import Health, Level, Wait
from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.wire.stamp_guard import describe_new_time

from ..allocation.assumed_actuators import assumed_actuators
from ..laws import ControlLaw
from .controller import Controller
from .law_set import LawSet
from .reference_input import ReferenceInput
from .settings import ControllerNodeSettings
from .state_input import StateInput
from .state_responder import StampStatus, StateResponder
from .supervisor import Mode, Supervisor

SupervisorOf = Callable[
    [Controller, Sequence[ControlLaw], ControllerNodeSettings], Supervisor | None
]
FLUSH_S = 1.0
LOOK_AHEAD_S = 0.02
"""The reference is looked for this often though it is not needed yet, so that no flood of others'
messages pushes it out of its queue."""
STAND_DOWN_S = 0.1
"""Longest wait of a deactivated controller for a state to answer, s."""


class ControllerLoop:
    """Loop that answers the newest state once its reference has arrived, each tick once."""

    is_complete = False

    def __init__(
        self,
        node: ManagedNode[ControllerNodeSettings],
        settings: ControllerNodeSettings,
        supervisor_of: SupervisorOf = lambda *_: None,
    ) -> None:
        """Load the laws' compiled code, so that no tick comes late for it.

        ``supervisor_of`` makes the supervisor from the controller, its laws and the settings; None
        stands for the usual one.
        """
        self._node, self._settings = node, settings
        robot = find_robot(settings.robot)
        self._laws = LawSet(node, settings, robot.n + 3)
        actuators = assumed_actuators(settings.actuators, robot)
        self._laws.warm_up(robot, actuators)
        self._controller = Controller(
            robot,
            self._laws.choice.chosen,
            settings.period,
            settings.acceleration_filter_hz,
            settings.filter_settings,
            actuators,
            settings.allocation,
        )
        timebase = settings.timebase
        self._states = StateInput(node, self._controller.names, timebase)
        self._references = ReferenceInput(
            node, robot, timebase, settings.reference_timeout, settings.join_timeout
        )
        self._answering = StateResponder(
            self._controller,
            self._laws.choice,
            self._references.buffer,
            settings,
            node.get_fully_qualified_name(),
            supervisor_of(self._controller, self._laws.laws, settings),
        )
        self._command_out = RawPublisher(node, topics.COMMAND)
        self._out = {
            topics.COMMAND: self._command_out,
            topics.TELEMETRY: RawPublisher(node, topics.TELEMETRY),
            topics.SIGNALS: RawPublisher(node, topics.SIGNALS),
            topics.LAW: RawPublisher(node, topics.LAW),
        }
        self.outputs = tuple(self._out.values())
        self._made_at = time.monotonic()
        self._unanswered = -1
        """A state's tick whose reference has not come yet; -1: none."""
        self._is_resumed = True
        """True until the first state since the activation."""
        self._state_at = time.monotonic()
        self._paused = PausedInput(node)
        self._look_ahead_at = 0.0

    @property
    def wait_for(self) -> Sequence[str]:
        """Return the topics to wait for; none after ``listener_timeout``. See `Loop.wait_for`."""
        timeout, waited = self._settings.listener_timeout, time.monotonic() - self._made_at
        return () if timeout and waited > timeout else self._settings.wait_for

    def begin(self) -> None:
        """Begin with the next state."""
        self._unanswered, self._is_resumed = -1, True

    def step(self) -> Wait | None:
        """Answer a state if it and its reference have arrived.

        Raises:
            FlightError: no reference has come in time.
        """
        tick = self._unanswered
        if tick < 0:
            received = self._states.take()
            if received is None:
                self._look_ahead(time.monotonic())
                return self._states.wait
            tick = received
            last = self._answering.supervisor.last_stamp
            standing = self._answering.judge(tick)
            if standing is StampStatus.ANSWERED:  # the plant asked again: the same answer
                self._command_out.publish(self._answering.answer)
                return None
            if standing is StampStatus.REFUSED:
                self._states.reject("stamp")
                return None
            if tick != last:
                self._believe(tick, last)
        reference = self._references.at(tick)
        if reference is None:
            is_awaited = self._references.is_awaited
            self._unanswered = tick if is_awaited else -1
            return self._references.wait if is_awaited else None
        self._unanswered = -1
        self._answer_tick(tick, reference)
        self._look_ahead(self._state_at)
        return None

    def deactivate(self) -> None:
        """Answer one more state with zero torque, which the plant holds."""
        answering = self._answering
        answered = answering.supervisor.answered
        if answered >= 0 and self._node.count_publishers(self._states.inputs[0].full_name):
            until = time.monotonic() + STAND_DOWN_S
            tick = self._unanswered
            while tick <= answered and time.monotonic() < until:
                self._node.let_others_work()
                received = self._states.take()
                tick = answered if received is None else received
            if tick > answered:
                none = answering.supervisor.deactivate(tick)
                self._command_out.publish(answering.encode(none))
        flush(self.outputs, FLUSH_S)

    def close(self) -> None:
        """Stop reacting to parameters."""
        self._laws.close()

    def health(self) -> Health:
        """Report the mode, the law, and rejected messages."""
        supervisor, references = self._answering.supervisor, self._references
        rejected = self._states.rejected + references.rejected + supervisor.rejected
        silence = time.monotonic() - max(self._state_at, self._paused.running_since)
        allocation = supervisor.diagnosis
        values: dict[str, float | int | str] = {
            "tick": supervisor.answered,
            "controller": self._controller.law.name,
            "references_held": references.held,
            **allocation.values,
            **{f"rejected: {reason}": count for reason, count in rejected.items()},
        }
        if references.is_waited_for:
            return Health("waiting for the reference: no mission sends it", Level.WARN, values)
        if supervisor.answered < 0:
            return Health("waiting for the first state", values=values)
        if supervisor.mode is not Mode.NOMINAL:
            level = Level.ERROR if supervisor.mode is Mode.SAFE else Level.WARN
            return Health(f"{supervisor.mode.value}: {supervisor.reason}", level, values)
        if silence > self._settings.state_timeout:
            values["silence_s"] = silence
            return Health("safe: no new state, so no command", Level.ERROR, values)
        if references.is_missing:
            return Health("holding the reference: the mission is silent", Level.WARN, values)
        if allocation.failed:
            return Health(allocation.summary, Level.WARN, values)
        return Health("nominal", values=values)

    def _look_ahead(self, now: float) -> None:
        """Read references periodically, before they are needed."""
        if now > self._look_ahead_at:
            self._references.take()
            self._look_ahead_at = now + LOOK_AHEAD_S

    def _answer_tick(self, tick: int, reference: Block) -> None:
        answering = self._answering
        mode = answering.supervisor.mode
        for topic, message in answering.messages(tick, self._states.state, reference):
            self._out[topic].publish(message)
            if topic is topics.COMMAND and answering.supervisor.mode is not mode:
                self._node.report()
        if answering.change:
            self._laws.tell(answering.change)

    def _believe(self, tick: int, last: int) -> None:
        """Accept a state with a plausible stamp, which may begin a new time."""
        if self._answering.supervisor.is_new_time and last >= 0:
            self._node.log(describe_new_time(tick, last, self._is_resumed))
        self._is_resumed = False
        self._state_at = time.monotonic()
