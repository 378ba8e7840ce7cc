"""The messages of a flight in this process, in a bag as the nodes would send them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.telemetry import (
    ClockCodec,
    LawCodec,
    ReferenceCodec,
    SignalsCodec,
    TelemetryCodec,
    TruthWriter,
)

from .plan import Flight

Array = NDArray[np.float64]


class Messages:
    """Writes a flight's messages into a bag, as the nodes would send them."""

    def __init__(self, flight: Flight, recorder: BagRecorder) -> None:
        names, timebase = flight.plant.names, flight.timebase
        self.record, self._flight = recorder.record, flight
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

    def show(self, tick: int, state_of: Callable[[int], RobotState]) -> None:
        """Write the poses of a tick's true state, if they are due."""
        if self._scene.is_due(tick):
            self._record_all(self._scene.poses(state_of(tick)))

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
    messages = Messages(flight, recorder)
    try:
        yield messages
    finally:
        messages.end()
        recorder.close()


def record(flight: Flight, log: FlightLog, bag: Path) -> None:
    """Write a flown flight into a bag, with the messages that `simulate` would have written.

    Args:
        flight: that was flown.
        log: of all its ticks, in memory.
        bag: folder to write.

    Raises:
        InputError: the bag cannot be written.
    """
    answered = log.ticks - log.unanswered
    with recording(flight, bag) as messages:
        assert messages
        messages.stretch(log, 0, log.ticks, answered)
