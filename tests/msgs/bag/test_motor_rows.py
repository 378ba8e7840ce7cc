"""Motors behind gears in bags: a column for each, named by its joint."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bags import TIMEBASE

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.samples import ALL_FIELDS, ReferenceChunk, RobotNames
from space_robot_msgs_py.wire.codecs import StateCodec
from space_robot_msgs_py.wire.reference_codec import ReferenceCodec

JOINTS = ("a", "b", "c")
NAMES = RobotNames(JOINTS, geared=("a", "c"))
TICKS = 60
MOTORS = ("motor_positions", "motor_velocities")


def flown(names: RobotNames = NAMES) -> FlightLog:
    """Return a flight by hand, another number everywhere."""
    rng = np.random.default_rng(3)
    log = FlightLog.allocate(
        TICKS, names.joints, TIMEBASE, passive_names=names.passive, geared_names=names.geared
    )
    for column in log.columns.values():
        column[:] = rng.normal(size=column.shape)
    return log


def read(
    folder: Path, log: FlightLog, names: RobotNames = NAMES, lost: tuple[int, ...] = ()
) -> FlightLog:
    """Return the flight from a bag of its messages; motors' messages of some ticks are lost."""
    recorder = BagRecorder(folder / "bag", {"period": TIMEBASE.period}, TIMEBASE)
    chunk = ReferenceChunk(0, log.reference_joints, log.reference_base)
    parts = ReferenceCodec(names.joints, TIMEBASE).encode(chunk)
    for topic, data in zip((topics.REFERENCE_JOINTS, topics.REFERENCE_BASE), parts, strict=True):
        recorder.record(topic, data)
    codec = StateCodec(names, TIMEBASE)
    for tick in range(log.ticks):
        for topic, data in zip(codec.topics, codec.encode(log.state(tick)), strict=True):
            if topic is not topics.MOTORS_STATE or tick not in lost:
                recorder.record(topic, data)
    recorder.close()
    return read_flight(folder / "bag")


@pytest.mark.parametrize("geared", [("a",), ("b", "c"), JOINTS])
def test_a_log_has_a_column_for_each(geared: tuple[str, ...], tmp_path: Path) -> None:
    names = NAMES._replace(geared=geared)
    log = flown(names)
    back = read(tmp_path, log, names)
    assert back.geared_names == geared
    assert not back.damage
    for name in ALL_FIELDS:
        np.testing.assert_array_equal(getattr(back, name), getattr(log, name), name)
    assert back.rows(10, 20).motor_velocities.shape == (10, len(geared))
    np.testing.assert_array_equal(back.state(9).numbers, log.state(9).numbers)


def test_a_robot_without_gears_has_none(tmp_path: Path) -> None:
    names = RobotNames(JOINTS)
    back = read(tmp_path, flown(names), names)
    assert back.geared_names == ()
    for name in MOTORS:
        assert getattr(back, name).shape == (TICKS, 0)


def test_where_a_message_is_lost_the_motors_are_unknown_and_nothing_else(tmp_path: Path) -> None:
    log = flown()
    back = read(tmp_path, log, lost=(0, 30, TICKS - 1))
    assert back.geared_names == NAMES.geared
    assert back.lost[topics.MOTORS_STATE.full_name] == 3
    kept = np.delete(np.arange(TICKS), [0, 30, TICKS - 1])
    for name in MOTORS:
        assert np.isnan(getattr(back, name)[[0, 30, TICKS - 1]]).all()
        np.testing.assert_array_equal(getattr(back, name)[kept], getattr(log, name)[kept], name)
    assert back.whole.all()
    np.testing.assert_array_equal(back.joint_positions, log.joint_positions)


def test_names_of_no_joint_are_no_motors_of_this_robot(tmp_path: Path) -> None:
    """Of another robot, say: they may be more than it has joints."""
    log, recorded = flown(), BagRecorder(tmp_path / "bag", {"period": TIMEBASE.period}, TIMEBASE)
    foreign = RobotNames(("p", "q", "r", "s", "t"), geared=("p", "q", "r", "s", "t"))
    other = StateCodec(foreign, TIMEBASE)
    chunk = ReferenceChunk(0, log.reference_joints, log.reference_base)
    parts = ReferenceCodec(JOINTS, TIMEBASE).encode(chunk)
    for topic, data in zip((topics.REFERENCE_JOINTS, topics.REFERENCE_BASE), parts, strict=True):
        recorded.record(topic, data)
    codec, theirs = StateCodec(RobotNames(JOINTS), TIMEBASE), flown(foreign)
    for tick in range(TICKS):
        for topic, data in zip(codec.topics, codec.encode(log.state(tick)), strict=True):
            recorded.record(topic, data)
        data = other.encode(theirs.state(tick))[other.topics.index(topics.MOTORS_STATE)]
        recorded.record(topics.MOTORS_STATE, data)
    recorded.close()
    back = read_flight(tmp_path / "bag")
    assert back.geared_names == ()
    np.testing.assert_array_equal(back.state(5).joint_positions, log.joint_positions[5])
