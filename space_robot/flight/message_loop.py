"""Closed loop of plant, mission and controller in this process, by messages.

So a flight whose messages fail is that of a graph in lockstep, by the same classes. Where the
nodes' timing would matter, the graph's flight need not repeat: here the controller takes every
state that reaches it, none is passed over.
"""

from __future__ import annotations

from collections.abc import Callable

from space_robot_control.controller.law_choice import LawChoice
from space_robot_control.controller.reference_buffer import ReferenceBuffer
from space_robot_control.controller.supervisor import StateResponder, Supervisor
from space_robot_control.controller.tick import NEW
from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import MessageError
from space_robot_msgs_py.samples import RobotState
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.stamp_guard import AGREEING
from space_robot_sim.plant.messages import NO_TICK, CommandGuard, PlantMessages, SentState

from .plan import Flight

Record = Callable[[topics.Topic, bytes], object]


class MessageLoop:
    """Loop that flies tick by tick and hands every message to ``record``."""

    def __init__(
        self,
        flight: Flight,
        record: Record,
        update_true_state: Callable[[RobotState], None],
        supervisor: Supervisor | None = None,
    ) -> None:
        """Begin at the flight's first tick.

        Args:
            flight: to be flown.
            record: called with every message.
            update_true_state: called with each true state that is not the measured one.
            supervisor: of the flight's controller, to answer (None: `Flight.supervisor`).
        """
        robot, settings = flight.robot, flight.plant_settings
        names = flight.plant.names
        self._flight, self._plant, self._record = flight, flight.plant, record
        self._tell_truth = update_true_state
        self._guard = CommandGuard(len(names.commanded), settings.hold_ticks)
        self._states = StateCodec(names, flight.timebase)
        self._commands = CommandCodec(names.commanded, flight.timebase)
        self._exchange = PlantMessages(settings, names, flight.period, self._states, self._guard)
        self._references = ReferenceBuffer(robot.n)
        self._answering = StateResponder(
            supervisor or flight.supervisor,
            LawChoice(flight.law, flight.swaps),
            self._references,
            flight.controller_settings,
        )
        self._state = RobotState.allocate(robot.n)
        self._streamed = 0
        """First tick that the mission has not sent yet."""

    def fly_tick(self) -> None:
        """Run mission and controller for the plant's tick, and step the plant.

        Raises:
            DivergedError: see `Plant.step`.
        """
        plant, tick = self._plant, self._plant.tick
        self._stream(tick)
        for sent in self._exchange.send(plant.state):
            for message in zip(self._states.topics, sent.messages, strict=True):
                self._record(*message)
            self._deliver(sent, tick)
        if plant.truth_topics:
            self._tell_truth(plant.truth)
        self._exchange.end(tick)
        plant.step(self._guard.act(tick))

    def _stream(self, tick: int) -> None:
        """Send the reference to the controller as far ahead as the mission does."""
        settings, mission = self._flight.mission_settings, self._flight.mission
        while self._streamed < tick + settings.lead_ticks:
            chunk = mission.chunk(self._streamed, settings.chunk_ticks)
            self._references.add(chunk)
            self._streamed = chunk.stop

    def _deliver(self, sent: SentState, tick: int) -> None:
        """Let the controller have a state; one whose answer is awaited comes until it is there."""
        for _ in range(1 if sent.answered_by == NO_TICK else AGREEING):
            if self._answer(sent, tick) == sent.answered_by:
                return

    def _answer(self, sent: SentState, tick: int) -> int:
        """Let the controller answer a state, once; the tick that is answered, `NO_TICK` if none is.

        An answer that is asked for again is left out: the next one overtakes it, or is lost
        with it.
        """
        state, references = self._state, self._references
        try:
            parts = zip(self._states.topics, sent.messages, strict=True)
            stamp, *_ = [self._states.decode(topic, data, state) for topic, data in parts]
        except MessageError:
            return NO_TICK
        if self._answering.judge_stamp(stamp) != NEW:
            return NO_TICK
        reference = references.at(stamp) if references.covers(stamp) else references.hold(stamp)
        if reference is None:
            return NO_TICK
        for topic, message in self._answering.messages(stamp, state, reference):
            self._record(topic, message)
            if topic is topics.COMMAND:
                self._commands.decode(message, self._guard.offered)
                self._exchange.take(tick)
        return stamp
