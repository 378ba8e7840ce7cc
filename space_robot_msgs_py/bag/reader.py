"""A bag as a `FlightLog`: ours, or one that ``ros2 bag record`` wrote of the same topics."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Connection
from rosbags.rosbag2 import Reader, ReaderError

from .. import topics
from ..codecs import StateCodec
from ..definitions import decode
from ..errors import InputError
from ..flight_log import FlightLog
from ..reference_codec import ReferenceCodec
from ..samples import RobotState, Timebase
from ..validation import read_yaml
from .coverage import Coverage, lost_messages, message_tick, unanswered_ticks
from .recorder import COVERAGE_KEY, FLIGHT_KEY

REQUIRED = (
    topics.JOINT_STATES, topics.BASE_STATE, topics.REFERENCE_JOINTS, topics.REFERENCE_BASE,
)  # fmt: skip


def read_flight(path: Path) -> FlightLog:
    """Read a flight.

    Raises:
        InputError: no bag is there, it is not whole, or a needed topic is missing or empty.
    """
    if not (path / "metadata.yaml").is_file():
        hint = "not a bag folder (no metadata.yaml)" if path.exists() else "no such bag"
        raise InputError(f"{path}: {hint}")
    try:
        with Reader(path) as reader:
            return _read(reader, path)
    except (ReaderError, OSError, ValueError, KeyError) as error:
        raise InputError(f"{path}: cannot be read as a flight ({error})") from None


def read_coverage(path: Path) -> dict[str, dict[str, int]]:
    """How many messages of each topic the recorder counted: received, missing, repeated.

    Empty for a bag of another recorder.
    """
    counts: dict[str, dict[str, int]] = json.loads(_custom_data(path).get(COVERAGE_KEY, "{}"))
    return counts


def _read(reader: Reader, path: Path) -> FlightLog:
    by_topic = {c.topic: c for c in reader.connections if c.topic in topics.BY_NAME}
    for topic in REQUIRED:
        connection = by_topic.get(topic.name)
        if connection is None or not connection.msgcount:
            raise InputError(f"{path}: no messages on {topic.name}")
    flight = _description(path)
    timebase = Timebase(round(float(flight.get("period", 0.0005)) * 1e9))
    joints_connection = by_topic[topics.JOINT_STATES.name]
    first = next(iter(reader.messages([joints_connection])))[2]
    names = tuple(decode(bytes(first), topics.JOINT_STATES.type).name)
    log = FlightLog.allocate(joints_connection.msgcount, names, timebase)
    log.flight = flight
    coverages = _fill(reader, list(by_topic.values()), log)
    log.lost = lost_messages(coverages, bool(flight.get("realtime")))
    if topics.COMMAND.name in coverages:
        log.unanswered = unanswered_ticks(coverages)
    whole = int(np.argmin(np.append(_complete_rows(log), False)))
    return log.truncated(whole)


def _description(path: Path) -> dict[str, Any]:
    """What our recorder noted of the flight; empty for a bag of another recorder."""
    description: dict[str, Any] = json.loads(_custom_data(path).get(FLIGHT_KEY, "{}"))
    return description


def _custom_data(path: Path) -> dict[str, str]:
    information = read_yaml(path / "metadata.yaml")["rosbag2_bagfile_information"]
    return information["custom_data"] or {}


def _fill(reader: Reader, connections: list[Connection], log: FlightLog) -> dict[str, Coverage]:
    states, references = (
        StateCodec(log.joint_names, log.timebase),
        ReferenceCodec(log.joint_names, log.timebase),
    )
    state = RobotState.allocate(len(log.joint_names))
    coverages = {c.topic: Coverage(topics.BY_NAME[c.topic]) for c in connections}
    for connection, _, raw in reader.messages(connections):
        topic, data = topics.BY_NAME[connection.topic], bytes(raw)
        tick = message_tick(topic, data, log.timebase)
        if not coverages[topic.name].take(tick):
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


def _complete_rows(log: FlightLog) -> NDArray[np.bool_]:
    columns = (log.joint_positions, log.quaternion, log.reference_joints, log.reference_base)
    rows = [np.isfinite(column.reshape(log.ticks, -1)).all(axis=1) for column in columns]
    complete: NDArray[np.bool_] = np.logical_and.reduce(rows)
    return complete
