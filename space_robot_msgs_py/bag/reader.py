"""A bag as a `FlightLog`: ours, or one that ``ros2 bag record`` wrote of the same topics."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import numpy as np
from rosbags.rosbag2 import ReaderError

from .. import topics
from ..codecs import StateCodec
from ..definitions import decode
from ..errors import InputError, MessageError
from ..flight_log import FlightLog
from ..reference_codec import ReferenceCodec
from ..samples import RobotState, Timebase
from .coverage import Coverage, excused_topics, lost_messages, message_tick, unanswered_ticks
from .folder import Bag, custom_data, open_bag
from .gaps import complete_rows, fill_gaps
from .recorder import COVERAGE_KEY, FLIGHT_KEY

REQUIRED = (
    topics.JOINT_STATES, topics.BASE_STATE, topics.REFERENCE_JOINTS, topics.REFERENCE_BASE,
)  # fmt: skip
UNREADABLE = (
    ReaderError, OSError, ValueError, LookupError, StopIteration, RuntimeError, struct.error,
)  # fmt: skip


def read_flight(path: Path) -> FlightLog:
    """Read a flight; of a bag that nobody finished (`FlightLog.unfinished`) what is there.

    Raises:
        InputError: no bag is there, it cannot be read, a needed topic is missing or empty, or not
            one tick is whole.
    """
    try:
        bag = open_bag(path)
        return _read(bag, path)
    except InputError:
        raise
    except UNREADABLE as error:
        raise InputError(f"{path}: cannot be read as a flight ({error})") from None


def read_coverage(path: Path) -> dict[str, dict[str, int]]:
    """How many messages of each topic the recorder counted: received, missing, repeated.

    Empty for a bag of another recorder.

    Raises:
        InputError: there is no finished bag.
    """
    counts: dict[str, dict[str, int]] = json.loads(custom_data(path).get(COVERAGE_KEY, "{}"))
    return counts


def _read(bag: Bag, path: Path) -> FlightLog:
    counts = bag.counts()
    state = "" if bag.finished else " (the bag was not finished)"
    for topic in REQUIRED:
        if not counts.get(topic.name):
            raise InputError(f"{path}: no messages on {topic.name}{state}")
    flight = json.loads(bag.custom_data().get(FLIGHT_KEY, "{}"))
    timebase = Timebase(round(float(flight.get("period", 0.0005)) * 1e9))
    _, first = next(bag.messages(topics.JOINT_STATES))
    names = tuple(decode(first, topics.JOINT_STATES.type).name)
    excused = excused_topics(flight)
    planned = int(flight.get("ticks", 0)) if excused else 0
    log = FlightLog.allocate(max(counts[topics.JOINT_STATES.name], planned), names, timebase)
    log.flight = flight
    recorded = [topic for topic in topics.ALL if topic.name in counts]
    coverages = _fill(bag, recorded, log)
    log.lost = lost_messages(coverages, excused, bag.finished)
    if topics.COMMAND.name in coverages:
        log.unanswered = unanswered_ticks(coverages, bag.finished)
    if excused:
        fill_gaps(log)
    whole = int(np.argmin(np.append(complete_rows(log), False)))
    if not whole:
        raise InputError(f"{path}: not one tick with its state and reference{state}")
    if not bag.finished:
        last_s = timebase.stamp_ns(whole - 1) / 1e9
        log.unfinished = f"the bag was not finished: read up to t = {last_s:.4f} s"
    return log.truncated(whole)


def _fill(bag: Bag, recorded: list[topics.Topic], log: FlightLog) -> dict[str, Coverage]:
    states, references = (
        StateCodec(log.joint_names, log.timebase),
        ReferenceCodec(log.joint_names, log.timebase),
    )
    state = RobotState.allocate(len(log.joint_names))
    coverages = {topic.name: Coverage(topic) for topic in recorded}
    for name, data in bag.messages(*recorded):
        topic = topics.BY_NAME[name]
        try:
            tick = message_tick(topic, data, log.timebase)
        except MessageError:
            coverages[name].strange += 1
            continue
        if not coverages[name].take(tick):
            continue
        if topic is topics.JOINT_STATES and tick < log.ticks:
            states.decode_joints(data, state)
            log.joint_positions[tick] = state.joint_positions
            log.joint_velocities[tick] = state.joint_velocities
            log.applied_torque[tick, 3:] = state.applied_torque[3:]
        elif topic is topics.BASE_STATE and tick < log.ticks:
            states.decode_base(data, state)
            log.base_position[tick] = state.base_position
            log.quaternion[tick] = state.quaternion
            log.base_velocity[tick] = state.base_velocity
            log.omega_base[tick] = state.omega_base
            log.applied_torque[tick, :3] = state.applied_torque[:3]
        elif topic is topics.REFERENCE_JOINTS and tick < log.ticks:
            start, rows = references.decode_joints(data)
            log.reference_joints[start : start + len(rows)] = rows[: log.ticks - start]
        elif topic is topics.REFERENCE_BASE and tick < log.ticks:
            start, rows = references.decode_base(data)
            log.reference_base[start : start + len(rows)] = rows[: log.ticks - start]
    return coverages
