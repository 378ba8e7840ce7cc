"""The controller node: a loop that answers every state with a command, laws as parameters."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

from rcl_interfaces.msg import ParameterDescriptor, SetParametersResult
from rclpy.parameter import Parameter

from space_robot_model.robot.find import find_robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.law_history import LawChange
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError, SpaceRobotError
from space_robot_msgs_py.ros.endpoints import PausedInput, RawPublisher, flush
from space_robot_msgs_py.ros.loop import Health, Level, Wait
from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.ros.parameters import overrides
from space_robot_msgs_py.samples import Reference, RobotState
from space_robot_msgs_py.wire.stamp_guard import describe_new_time

from ..allocation.settings import assumed_actuators
from ..laws import ControlLaw
from .controller import Controller
from .gains import NOMINAL_H_BAR, Laws, check_gains, gain_lengths, gain_range, split_gains
from .inputs import ReferenceInput, StateInput
from .law_choice import LawChoice, parse_swaps
from .live_telemetry import LiveTelemetry
from .settings import ControllerNodeSettings
from .supervisor import StateResponder, Supervisor
from .tick import ANSWERED, MODES, NOMINAL, REFUSED, SAFE

SupervisorOf = Callable[[Controller, Sequence[ControlLaw], ControllerNodeSettings], Supervisor]
FLUSH_S = 1.0
LOOK_AHEAD_S = 0.02
"""The reference is looked for this often though it is not needed yet, so that no flood of others'
messages pushes it out of its queue."""
DEACTIVATION_S = 0.1
"""Longest wait of a deactivated controller for a state to answer, s."""


class ControllerLoop:
    """Loop that answers the newest state once its reference has arrived, each tick once."""

    is_complete = False

    def __init__(
        self,
        node: ManagedNode[ControllerNodeSettings],
        settings: ControllerNodeSettings,
        make_supervisor: SupervisorOf = lambda controller, _, settings: Supervisor(
            controller, settings.hold_ticks, settings.longest_jump
        ),
    ) -> None:
        """Make laws, controller and topics.

        ``make_supervisor`` makes the supervisor from the controller, its laws and the settings.
        """
        self._node, self._settings = node, settings
        robot = find_robot(settings.robot)
        self._laws = LawSet(node, settings, robot.n + 3)
        actuators = assumed_actuators(settings.actuators, robot)
        at_rest = RobotState.allocate(robot.n), Reference.at_rest(robot.n)
        for law in self._laws.laws:  # loads compiled code: no tick or swap must wait for it
            supervisor = Supervisor(Controller(robot, law, settings.period, actuators=actuators), 0)
            supervisor.judge_stamp(at_rest[0].tick)
            supervisor.answer(*at_rest)
        law = self._laws.choice.chosen
        self._controller = Controller.from_settings(robot, law, settings, actuators)
        timebase = settings.timebase
        self._states = StateInput(node, self._controller.names, timebase)
        self._references = ReferenceInput(
            node, robot, timebase, settings.reference_timeout, settings.join_timeout
        )
        laws = [law.name for law in self._laws.laws]
        self._telemetry = LiveTelemetry.from_settings(settings, self._controller.names, laws)
        self._answering = StateResponder(
            make_supervisor(self._controller, self._laws.laws, settings),
            self._laws.choice,
            self._references.buffer,
            settings,
            node.get_fully_qualified_name(),
            self._telemetry.report if self._telemetry else None,
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
            status = self._answering.judge_stamp(tick)
            if status == ANSWERED:  # the plant asked again: the same answer
                self._command_out.publish(self._answering.answer)
                return None
            if status == REFUSED:
                self._states.reject("stamp")
                return None
            if tick != last:
                if self._answering.supervisor.is_new_time and last >= 0:
                    self._node.log(describe_new_time(tick, last, self._is_resumed))
                self._is_resumed, self._state_at = False, time.monotonic()
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
            until = time.monotonic() + DEACTIVATION_S
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
        """Stop reacting to parameters, and close the telemetry."""
        self._laws.close()
        if self._telemetry:
            self._telemetry.close()

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
        if references.is_overdue:
            return Health("waiting for the reference: no mission sends it", Level.WARN, values)
        if supervisor.answered < 0:
            return Health("waiting for the first state", values=values)
        if supervisor.mode != NOMINAL:
            level = Level.ERROR if supervisor.mode == SAFE else Level.WARN
            return Health(f"{MODES[supervisor.mode]}: {supervisor.reason}", level, values)
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
            if topic is topics.COMMAND and answering.supervisor.mode != mode:
                self._node.report()
        if answering.change:
            self._laws.report(answering.change)


class LawSet:
    """The laws of the gain set as parameters: ``controller``, and ``<law>.<gain>`` for each."""

    def __init__(self, node: ManagedNode[Any], settings: ControllerNodeSettings, axes: int) -> None:
        """Build all laws and declare their gains.

        Raises:
            InputError: a law, a gain or a swap is invalid.
        """
        self._node, self._settings, self._axes = node, settings, axes
        _, gains = split_gains(overrides(node))
        self._laws = Laws(settings, axes, gains)
        self.laws = list(self._laws.values())
        """All laws, that in force at the start first."""
        for law in self.laws:
            self._declare(law)
        swaps = [
            (tick, self._laws[one_of(name, self._laws, "controller", " of swaps")])
            for tick, name in parse_swaps(settings.swaps, settings.period)
        ]
        self.choice = LawChoice(self.laws[0], swaps)
        """The law in force."""
        descriptor = node.describe_parameter("controller")
        descriptor.additional_constraints = f"one of {', '.join(self._laws)}"
        node.set_descriptor("controller", descriptor)
        node.add_on_set_parameters_callback(self._on_set)

    def report(self, change: LawChange) -> None:
        """Log a change, and let the parameter ``controller`` follow a planned swap."""
        when = (
            f"from tick {change.law.tick} on (t = {change.law.tick * self._settings.period:.4f} s)"
        )
        self._node.log(f"controller: {change}, {when}")
        if self.choice.was_swapped:
            self.choice.was_swapped = False
            name = Parameter("controller", value=change.law.name)  # type: ignore[no-untyped-call]
            self._node.set_parameters([name])

    def close(self) -> None:
        """Stop accepting changes."""
        self._node.remove_on_set_parameters_callback(self._on_set)

    def _declare(self, law: ControlLaw) -> None:
        descriptions = law.gain_descriptions()
        for gain, values in law.gain_values.items():
            self._node.declare_parameter(
                f"{law.name}.{gain}",
                values.tolist(),
                ParameterDescriptor(
                    description=descriptions[gain],
                    additional_constraints=f"{gain_lengths(self._axes)}; {gain_range(gain)}",
                ),
                ignore_override=True,
            )

    def _on_set(self, parameters: list[Any]) -> SetParametersResult:
        """Check all changes first, then make them; the loop sees them at its next tick."""
        gains = {name: law.gain_values for name, law in self._laws.items()}
        chosen = self.choice.chosen
        try:
            for parameter in parameters:
                law_name, _, gain = parameter.name.partition(".")
                if parameter.name == "controller":
                    chosen = self._laws[one_of(parameter.value, self._laws, "controller")]
                elif law_name in gains and gain:
                    law = self._laws[law_name]
                    changed = {**gains[law_name], gain: list(parameter.value)}
                    gains[law_name] = check_gains(changed, type(law), self._axes, "parameter")
                    if gain == "h_bar" and any(gains[law_name][gain]) != law.h_bar.any():
                        # compiled code is that of one of the two
                        kinds = ["a constant", NOMINAL_H_BAR]
                        before, after = kinds if law.h_bar.any() else kinds[::-1]
                        raise InputError(
                            f"parameter {law_name}.h_bar cannot be changed from {before} to "
                            f"{after} in flight: start with that gain, or swap to another law"
                        )
        except SpaceRobotError as error:
            return SetParametersResult(successful=False, reason=str(error))
        for name, law in self._laws.items():
            law.gain_values = gains[name]
        self.choice.choose(chosen)
        return SetParametersResult(successful=True)
