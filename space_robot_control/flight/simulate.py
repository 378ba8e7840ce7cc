"""A flight in this process: the same plant, mission and controller, without ROS."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag import BagRecorder
from space_robot_msgs_py.codecs import ClockCodec, CommandCodec, StateCodec, TelemetryCodec
from space_robot_msgs_py.flight_log import FlightLog
from space_robot_msgs_py.reference_codec import ReferenceCodec
from space_robot_msgs_py.samples import Command, ReferenceChunk, RobotState

from ..reference import ReferenceBuffer
from .plan import Flight

PROGRESS_TICKS = 2000


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

    def reference(self, chunk: ReferenceChunk) -> None:
        """What the mission sends."""
        joints, base = self._references.encode(chunk)
        self._recorder.record(topics.REFERENCE_JOINTS, joints)
        self._recorder.record(topics.REFERENCE_BASE, base)

    def tick(self, state: RobotState, command: Command) -> None:
        """What plant and controller send in a tick."""
        record, tick, flight = self._recorder.record, state.tick, self._flight
        joints, base = self._states.encode(state)
        record(topics.JOINT_STATES, joints)
        record(topics.BASE_STATE, base)
        record(topics.COMMAND, self._commands.encode(command))
        if tick % flight.plant_settings.clock_decimation == 0:
            record(topics.CLOCK, self._clock.encode(flight.timebase.stamp_ns(tick)))
        if tick % flight.controller_settings.telemetry_decimation == 0:
            rows = flight.controller.telemetry()
            record(topics.TELEMETRY, self._telemetry.encode(tick, rows))


@contextmanager
def _recording(flight: Flight, bag: Path | None) -> Iterator[Messages | None]:
    if bag is None:
        yield None
        return
    recorder = BagRecorder(bag, flight.description, flight.timebase)
    try:
        yield Messages(flight, recorder)
    finally:
        recorder.close()


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
        InputError: the bag cannot be written.
    """
    plant, controller, mission = flight.plant, flight.controller, flight.mission
    chunk_ticks = flight.mission_settings.chunk_ticks
    references = ReferenceBuffer(flight.robot.n)
    log = FlightLog.allocate(flight.ticks, flight.robot.joint_names, flight.timebase)
    log.flight = flight.description
    log.lost = {topic.name: 0 for topic in topics.ALL}
    log.telemetry = np.full((flight.ticks, 4, log.axes), np.nan)
    with _recording(flight, bag) as messages:
        for tick in range(flight.ticks):
            if tick % chunk_ticks == 0:
                chunk = mission.chunk(tick, chunk_ticks)
                references.add(chunk)
                if messages:
                    messages.reference(chunk)
            joints, base = references.at(tick)
            state = plant.state
            log.put(state)
            log.reference_joints[tick], log.reference_base[tick] = joints, base
            command = controller.update(state, joints, base)
            log.telemetry[tick] = controller.telemetry()
            if messages:
                messages.tick(state, command)
            plant.step(command)
            if tick % PROGRESS_TICKS == 0:
                progress(tick)
    progress(flight.ticks)
    return log
