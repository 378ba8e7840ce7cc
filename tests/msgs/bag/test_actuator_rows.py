"""Wheels and thrusters in bags: columns as wide as there are actuators, whoever recorded them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bags import TIMEBASE

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.samples import (
    ACTUATOR_FIELDS,
    MOST_WHEELS,
    Command,
    ReferenceChunk,
    RobotNames,
)
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.reference_codec import ReferenceCodec

NAMES = RobotNames(("a", "b"), ("wheel_1", "wheel_2", "wheel_3"), ("thruster_1", "thruster_2"))
TICKS = 300
FLIGHT = {"period": TIMEBASE.period}
Keep = Callable[[topics.Topic, int], bool]


def flown(names: RobotNames = NAMES) -> FlightLog:
    """A flight by hand, another number everywhere."""
    rng = np.random.default_rng(3)
    counts = len(names.wheels), len(names.thrusters)
    log = FlightLog.allocate(
        TICKS, names.joints, TIMEBASE, *counts, names.passive, torquers=len(names.torquers)
    )
    log.commanded_torque = np.empty((TICKS, len(names.axes)))
    for column in log.columns.values():
        column[:] = rng.normal(size=column.shape)
    return log


def recorded(
    log: FlightLog,
    folder: Path,
    names: RobotNames = NAMES,
    keep: Keep = lambda topic, tick: True,
    commanded: tuple[str, ...] = (),
    faults: list[str] | None = None,
) -> FlightLog:
    """The flight read from a bag of the messages that are kept."""
    recorder = BagRecorder(folder, {**FLIGHT, "faults": faults or []}, TIMEBASE)
    states, order = StateCodec(names, TIMEBASE), commanded or names.commanded
    commands = CommandCodec(order, TIMEBASE)
    references = ReferenceCodec(names.joints, TIMEBASE)
    chunk = ReferenceChunk(0, log.reference_joints, log.reference_base)
    for topic, data in zip(
        (topics.REFERENCE_JOINTS, topics.REFERENCE_BASE), references.encode(chunk), strict=True
    ):
        recorder.record(topic, data)
    assert log.commanded_torque is not None
    for tick in range(TICKS):
        asked = np.concatenate((log.commanded_torque[tick], log.actuator_commands[tick]))
        torque = asked[[names.commanded.index(name) for name in order]]
        if keep(topics.COMMAND, tick):
            recorder.record(topics.COMMAND, commands.encode(Command(tick, torque)))
        for topic, data in zip(states.topics, states.encode(log.state(tick)), strict=True):
            if keep(topic, tick):
                recorder.record(topic, data)
    recorder.close()
    return read_flight(folder)


def assert_same(log: FlightLog, expected: FlightLog) -> None:
    for name in (*ACTUATOR_FIELDS, "actuator_commands", "commanded_torque", "applied_torque"):
        np.testing.assert_array_equal(getattr(log, name), getattr(expected, name), name)


@pytest.mark.parametrize(
    "names",
    [
        NAMES,
        NAMES._replace(thrusters=()),
        NAMES._replace(wheels=()),
        NAMES._replace(torquers=("torquer_1", "torquer_2")),
        RobotNames(NAMES.joints),
    ],
    ids=["both", "wheels", "thrusters", "torquers", "none"],
)
def test_a_log_has_a_column_for_each_actuator(names: RobotNames, tmp_path: Path) -> None:
    log = flown(names)
    read = recorded(log, tmp_path / "bag", names)
    assert_same(read, log)
    assert read.damage == ()
    assert not any(
        read.lost[topic.full_name] for topic in (topics.WHEELS_STATE, topics.THRUSTERS_STATE)
    )
    assert read.rows(10, 20).wheel_velocities.shape == (10, len(names.wheels))


def test_states_of_a_log_have_zero_where_no_actuator_is() -> None:
    state = flown().state(4)
    assert state.wheel_velocities.shape == (MOST_WHEELS,)
    assert state.wheel_velocities[:3].all()
    assert not state.wheel_velocities[3:].any()
    back = FlightLog.allocate(TICKS, NAMES.joints, TIMEBASE, 3, 2)
    back.put(4, state.block)
    for name in ACTUATOR_FIELDS:
        np.testing.assert_array_equal(getattr(back, name)[4], getattr(flown(), name)[4], name)


def test_a_command_of_another_order_is_read_by_name(tmp_path: Path) -> None:
    """Actuators in between the axes; they keep their order."""
    log = flown()
    order = (*NAMES.actuators[:2], *NAMES.axes[::-1], *NAMES.actuators[2:])
    assert_same(recorded(log, tmp_path / "bag", commanded=order), log)


def test_lost_states_of_wheels_are_counted_and_leave_gaps(tmp_path: Path) -> None:
    log = flown()
    read = recorded(
        log,
        tmp_path / "bag",
        keep=lambda topic, tick: topic is not topics.WHEELS_STATE or tick not in (7, 8, 200),
    )
    assert read.lost[topics.WHEELS_STATE.full_name] == 3
    gaps = np.flatnonzero(np.isnan(read.wheel_velocities).any(axis=1))
    assert gaps.tolist() == [7, 8, 200]
    np.testing.assert_array_equal(read.thrusts, log.thrusts)


def test_states_that_a_fault_kept_back_have_the_wheels_of_before(tmp_path: Path) -> None:
    """All parts of a state are kept back as one, and filled as one; none is called lost."""
    log = flown()
    read = recorded(
        log,
        tmp_path / "bag",
        keep=lambda topic, tick: topic not in topics.STATES or tick != 50,
        faults=["drop_state@0"],
    )
    assert read.filled == 1
    assert not any(read.lost[topic.full_name] for topic in topics.STATES)
    for name in (*ACTUATOR_FIELDS, "quaternion"):
        column, true = getattr(read, name), getattr(log, name)
        np.testing.assert_array_equal(column[50], true[49], name)
        np.testing.assert_array_equal(np.delete(column, 50, 0), np.delete(true, 50, 0), name)


def test_more_wheels_than_there_may_be_are_left_out_and_told(tmp_path: Path) -> None:
    too_many = RobotNames(NAMES.joints, tuple(f"wheel_{k}" for k in range(MOST_WHEELS + 1)))
    recorder = BagRecorder(tmp_path / "bag", FLIGHT, TIMEBASE)
    names = RobotNames(("a", "b"))
    log = flown(names)
    commands = CommandCodec(too_many.wheels, TIMEBASE)  # of the wheels' form: names and efforts
    states = StateCodec(names, TIMEBASE)
    references = ReferenceCodec(names.joints, TIMEBASE)
    joints, base = references.encode(ReferenceChunk(0, log.reference_joints, log.reference_base))
    recorder.record(topics.REFERENCE_JOINTS, joints)
    recorder.record(topics.REFERENCE_BASE, base)
    for tick in range(TICKS):
        for topic, data in zip(states.topics, states.encode(log.state(tick)), strict=True):
            recorder.record(topic, data)
        wheels = commands.encode(Command(tick, np.zeros(MOST_WHEELS + 1)))
        recorder.record(topics.WHEELS_STATE, wheels)
    recorder.close()
    read = read_flight(tmp_path / "bag")
    assert read.wheel_velocities.shape == (TICKS, 0)
    assert any("on /wheels/state do not fit" in text for text in read.damage)
