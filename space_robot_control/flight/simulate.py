"""A flight in this process: the same plant, mission and controller, without ROS."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.flight_log import FlightLog
from space_robot_msgs_py.plain_codecs import ClockCodec, LawCodec, TelemetryCodec
from space_robot_msgs_py.reference_codec import ReferenceCodec
from space_robot_msgs_py.samples import Command

from ..closed_loop import close_loop
from ..law_history import same
from .plan import Flight

STRETCH_TICKS = 2000
"""Ticks flown between two looks at the world outside."""


class Messages:
    """Writes a flight's messages into a bag, as the nodes would send them."""

    def __init__(self, flight: Flight, recorder: BagRecorder) -> None:
        robot, timebase = flight.robot, flight.timebase
        self._recorder, self._flight = recorder, flight
        self._states = StateCodec(robot.joint_names, timebase)
        self._commands = CommandCodec(robot.axis_names, timebase)
        self._references = ReferenceCodec(robot.joint_names, timebase)
        self._telemetry = TelemetryCodec(robot.axis_names)
        self._clock = ClockCodec()
        self._law = LawCodec(timebase)

    def stretch(self, log: FlightLog, start: int, stop: int) -> None:
        """What mission, plant and controller send in the ticks ``start`` to ``stop``."""
        assert log.commanded_torque is not None
        assert log.telemetry is not None
        record, flight = self._recorder.record, self._flight
        chunk_ticks = flight.mission_settings.chunk_ticks
        laws = [law for law in log.laws if start <= law.tick < stop]
        for tick in range(start, stop):
            if tick % chunk_ticks == 0:
                joints, base = self._references.encode(flight.mission.chunk(tick, chunk_ticks))
                record(topics.REFERENCE_JOINTS, joints)
                record(topics.REFERENCE_BASE, base)
            joints, base = self._states.encode(log.state(tick))
            record(topics.JOINT_STATES, joints)
            record(topics.BASE_STATE, base)
            record(topics.COMMAND, self._commands.encode(Command(tick, log.commanded_torque[tick])))
            if laws and laws[0].tick == tick:
                record(topics.LAW, self._law.encode(laws.pop(0)))
            if tick % flight.plant_settings.clock_decimation == 0:
                record(topics.CLOCK, self._clock.encode(flight.timebase.stamp_ns(tick)))
            if tick % flight.controller_settings.telemetry_decimation == 0:
                s, u, n_hat, e = log.telemetry[tick]
                record(topics.TELEMETRY, self._telemetry.encode(tick, (s, u, n_hat, e)))


@contextmanager
def _recording(flight: Flight, bag: Path | None) -> Iterator[Messages | None]:
    if bag is None:
        yield None
        return
    settings = flight.recorder_settings
    recorder = BagRecorder(
        bag, flight.description, flight.timebase, settings.compression, settings.split_size
    )
    try:
        yield Messages(flight, recorder)
    finally:
        recorder.close()


def unflown(flight: Flight) -> FlightLog:
    """The log of ``flight`` before it starts: the reference alone is known."""
    log = FlightLog.allocate(flight.ticks, flight.robot.joint_names, flight.timebase)
    log.flight = flight.description
    log.lost = {topic.name: 0 for topic in topics.ALL}
    log.commanded_torque = np.empty_like(log.applied_torque)
    log.telemetry = np.empty((log.ticks, 4, log.axes))
    reference = flight.mission.chunk(0, log.ticks)
    log.reference_joints, log.reference_base = reference.joints, reference.base
    return log


def simulate(
    flight: Flight,
    bag: Path | None = None,
    progress: Callable[[int], None] = lambda tick: None,
) -> FlightLog:
    """Fly every tick of ``flight`` and return what happened.

    Args:
        flight: a checked plan; its plant is flown on from where it stands.
        bag: where to write the messages the graph would have sent (None: nowhere).
        progress: called now and then with the ticks flown.

    Raises:
        FlightError: the flight diverged or met a singular attitude; the bag is closed.
        InputError: the bag cannot be written, or faults are to be injected.
    """
    if flight.plan.faults:
        raise InputError(f"faults {flight.plan.faults}: they need the graph of nodes: use `fly`")
    plant, controller, ticks = flight.plant, flight.controller, flight.ticks
    log, swaps = unflown(flight), dict(flight.swaps)
    cuts = sorted({*range(0, ticks, STRETCH_TICKS), *(k for k in swaps if k < ticks), ticks})
    with _recording(flight, bag) as messages:
        for start, stop in itertools.pairwise(cuts):
            progress(start)
            if start in swaps and swaps[start].name != controller.law.name:
                controller.law = swaps[start]
            law = controller.law.in_force(start, is_first=not log.laws)
            if not log.laws or not same(log.laws[-1], law):
                log.laws += (law,)
            close_loop(plant, controller, log, start, stop)
            if messages:
                messages.stretch(log, start, stop)
    progress(ticks)
    return log
