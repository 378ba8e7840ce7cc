"""The messages of a flight in this process: in a bag as nodes would send them, and as a loop."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from datetime import datetime, timezone
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from space_robot_control.controller.law_choice import LawChoice
from space_robot_control.controller.reference_buffer import ReferenceBuffer
from space_robot_control.controller.supervisor import Report, StateResponder, Supervisor
from space_robot_control.controller.tick import NEW
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError, MessageError
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.stamp_guard import AGREEING
from space_robot_msgs_py.wire.telemetry import (
    ClockCodec,
    LawCodec,
    ReferenceCodec,
    SignalsCodec,
    TelemetryCodec,
    TruthWriter,
)
from space_robot_sim.plant.messages import NO_TICK, CommandGuard, PlantMessages, SentState

from .flown_log import empty_log
from .plan import Flight

Record = Callable[[topics.Topic, bytes], object]
LARGE_BAG = 500e6
"""Bytes of a bag that a user is told before it is written."""
MOST_TICK_BYTES = 5000
"""Above those of any flight's tick: bags of fewer ticks are not measured."""
SAMPLE_TICKS, RECORD_BYTES = 1000, 31
"""Ticks whose messages are counted, and bytes of a message's header in MCAP."""
COMPRESSED = {"none": 1.0, "lz4": 0.48, "zstd": 0.4}
"""Share of its bytes that a bag has, as measured with sensors."""


class Messages:
    """Writes a flight's messages into a bag, as the nodes would send them."""

    def __init__(self, flight: Flight, record: Record) -> None:
        names, timebase = flight.plant.names, flight.timebase
        self.record, self._flight = record, flight
        self._states = StateCodec(names, timebase)
        self._truth = TruthWriter(names, timebase, flight.plant.truth_topics)
        self._commands = CommandCodec(names.commanded, timebase)
        self._references = ReferenceCodec(names.joints, timebase)
        self._telemetry = TelemetryCodec(names.axes)
        self._signals = SignalsCodec(names.axes, flight.timebase)
        self._clock = ClockCodec()
        self._law = LawCodec(timebase)
        from space_robot_sim.plant.scene import SceneWriter  # of no use without a bag

        self._scene = SceneWriter(flight.robot, timebase)
        self._record_all(self._scene.lasting())

    def begin_tick(self, tick: int) -> None:
        """Write the periodic messages: the reference from ``tick`` on, and the clock."""
        flight = self._flight
        chunk_ticks = flight.mission_settings.chunk_ticks
        if tick % chunk_ticks == 0:
            joints, base = self._references.encode(flight.mission.chunk(tick, chunk_ticks))
            self.record(topics.REFERENCE_JOINTS, joints)
            self.record(topics.REFERENCE_BASE, base)
        if tick % flight.plant_settings.clock_decimation == 0:
            self.record(topics.CLOCK, self._clock.encode(flight.timebase.stamp_ns(tick)))

    def update_true_state(self, state: RobotState) -> None:
        """Write the true state of a tick, with some before it."""
        self._record_all(self._truth.add(state))

    def show(self, tick: int, get_state: Callable[[int], RobotState]) -> None:
        """Write the poses of a tick's true state, if they are due."""
        if self._scene.is_due(tick):
            self._record_all(self._scene.poses(get_state(tick)))

    def end(self) -> None:
        """Write the buffered messages."""
        self._record_all(self._truth.flush())

    def _record_all(self, messages: Iterable[tuple[topics.Topic, bytes]]) -> None:
        for message in messages:
            self.record(*message)

    def stretch(self, log: FlightLog, start: int, stop: int, answered: int) -> None:
        """Write what mission, plant and controller send in the ticks ``start`` to ``stop``.

        All of them are in ``log``; the controller answers those before ``answered``.
        """
        assert log.commanded_torque is not None
        assert log.telemetry is not None
        record, flight = self.record, self._flight
        laws = [law for law in log.laws if start <= law.tick < stop]
        measured, true_states = log.as_measured(), log.states(start, stop)
        for tick, state in enumerate(measured.states(start, stop), start):
            self.begin_tick(tick)
            parts = self._states.encode(state)
            for topic, data in zip(self._states.topics, parts, strict=True):
                record(topic, data)
            if flight.plant.truth_topics:
                self.update_true_state(next(true_states))
            self.show(tick, log.state)
            if tick >= answered:
                continue
            row = tick - log.first_tick
            torque = np.concatenate((log.commanded_torque[row], log.actuator_commands[row]))
            record(topics.COMMAND, self._commands.encode(Command(tick, torque)))
            if laws and laws[0].tick == tick:
                record(topics.LAW, self._law.encode(laws.pop(0)))
            if tick % flight.controller_settings.telemetry_decimation == 0:
                if np.isnan(log.telemetry[row]).all():  # the law was not asked, on a bench
                    continue
                s, u, n_hat, e = log.telemetry[row]
                record(topics.TELEMETRY, self._telemetry.encode(tick, (s, u, n_hat, e)))
                record(topics.SIGNALS, self._signals.encode(tick, e, s, n_hat))


def bag_remark(flight: Flight) -> str:
    """Return what a large bag of a flight will need, in a line; empty: it is a small one."""
    if flight.ticks * MOST_TICK_BYTES < LARGE_BAG or (size := bag_size(flight)) < LARGE_BAG:
        return ""
    return f"the bag of {flight.ticks * flight.period:g} s will need about {size / 1e9:.1f} GB"


def bag_size(flight: Flight) -> float:
    """Return about how many bytes the bag of a flight will have, from its first messages."""
    sizes: list[int] = []
    messages = Messages(flight, lambda topic, data: sizes.append(len(data) + RECORD_BYTES))
    log = empty_log(flight, 0, SAMPLE_TICKS, np.zeros)
    for states in (log, log.as_measured()):
        states.quaternion[:, 0] = 1.0
    messages.stretch(log, 0, SAMPLE_TICKS, SAMPLE_TICKS)
    messages.end()
    share = COMPRESSED[flight.scenario.recorder.compression]
    return share * sum(sizes) / SAMPLE_TICKS * flight.ticks


@contextmanager
def recording(flight: Flight, bag: Path | None) -> Iterator[Messages | None]:
    """Open a bag for the flight's messages, and close it; None: nothing is written."""
    if bag is None:
        yield None
        return
    settings = flight.scenario.recorder
    recorder = BagRecorder(
        bag, flight.description, flight.timebase, settings.compression, settings.split_size
    )
    messages = Messages(flight, recorder.record)
    try:
        yield messages
    finally:
        messages.end()
        recorder.close()


def record(flight: Flight, log: FlightLog, bag: Path) -> None:
    """Write a flown flight into a bag, with the messages that `simulate` would have written."""
    answered = log.ticks - log.unanswered
    with recording(flight, bag) as messages:
        assert messages
        messages.stretch(log, 0, log.ticks, answered)


def answers(
    responder: StateResponder,
    references: ReferenceBuffer,
    codec: StateCodec,
    parts: Iterable[tuple[topics.Topic, bytes]],
    state: RobotState,
) -> Iterator[tuple[topics.Topic, bytes]]:
    """Yield the messages that answer a state, given by its parts; none if it is not taken.

    It is decoded into ``state``, which has its tick once it is answered.
    """
    try:
        tick, *_ = [codec.decode(topic, data, state) for topic, data in parts]
    except MessageError:
        return
    if responder.judge_stamp(tick) != NEW:
        return
    reference = references.at(tick) if references.covers(tick) else references.hold(tick)
    if reference is not None:
        yield from responder.messages(tick, state, reference)


class MessageLoop:
    """Closed loop of plant, mission and controller by messages; hands each to ``record``.

    So a flight whose messages fail is that of a graph in lockstep, by the same classes. Where the
    nodes' timing would matter, the graph's flight need not repeat: here the controller takes every
    state that reaches it, none is passed over.
    """

    def __init__(
        self,
        flight: Flight,
        record: Record,
        update_true_state: Callable[[RobotState], None],
        supervisor: Supervisor | None = None,
        report: Report | None = None,
    ) -> None:
        """Begin at the flight's first tick.

        ``update_true_state`` gets each true state that is not the measured one; ``report``: see
        `StateResponder`.
        """
        robot, settings = flight.robot, flight.plant_settings
        names = flight.plant.names
        self._flight, self._plant, self._record = flight, flight.plant, record
        self._update_true_state = update_true_state
        self._guard = CommandGuard(len(names.commanded), settings.hold_ticks)
        self._states = StateCodec(names, flight.timebase)
        self._commands = CommandCodec(names.commanded, flight.timebase)
        self._exchange = PlantMessages(settings, names, flight.period, self._states, self._guard)
        self._references = ReferenceBuffer(robot.n)
        self._responder = StateResponder(
            supervisor or flight.supervisor,
            LawChoice(flight.law, flight.swaps),
            self._references,
            flight.controller_settings,
            report=report,
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
            self._update_true_state(plant.truth)
        self._exchange.end(tick)
        plant.step(self._guard.act(tick))

    def _stream(self, tick: int) -> None:
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
        parts, stamp = zip(self._states.topics, sent.messages, strict=True), NO_TICK
        for topic, message in answers(
            self._responder, self._references, self._states, parts, self._state
        ):
            stamp = self._state.tick
            self._record(topic, message)
            if topic is topics.COMMAND:
                self._commands.decode(message, self._guard.offered)
                self._exchange.take(tick)
        return stamp


def default_bag(flight: Flight) -> Path:
    """Return ``flights/<controller>_case<case>_<time>`` below the current folder.

    In a namespace its name comes first: two robots may start in the same second.
    """
    stamp = datetime.now(timezone.utc).strftime("%Y%m%d-%H%M%S")
    case = Path(flight.plant_settings.case).stem
    where = flight.scenario.options.namespace.lstrip("/").replace("/", "_")
    return Path("flights") / "_".join(
        filter(None, (where, flight.controller_name, f"case{case}", stamp))
    )


def check_bag_path(path: Path) -> None:
    """Check that a bag can be made at a path, without creating it.

    Raises:
        InputError: the path exists, or its nearest existing folder cannot be written.
    """
    if _is_taken(path):
        raise InputError(f"{path}: exists already; a bag is never overwritten")
    parent = path
    try:
        parent = next(p for p in path.absolute().parents if p.exists())
        with TemporaryDirectory(dir=parent):
            pass
    except OSError as error:
        raise InputError(
            f"{path}: no bag can be written there ({parent}: {error.strerror})"
        ) from None


def _is_taken(path: Path) -> bool:
    try:
        path.lstat()
    except (FileNotFoundError, NotADirectoryError):
        return False
    except OSError as error:
        raise InputError(f"{path}: no bag can be written there ({error.strerror})") from None
    except ValueError as error:
        raise InputError(f"{short(str(path))}: no name of a folder ({error})") from None
    return True
