"""Columns of a log: as many as the robot has wheels, thrusters, motors, joints without motors."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pytest
from bags import TIMEBASE

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import (
    ALL_FIELDS,
    MOST_PASSIVE,
    MOST_WHEELS,
    Command,
    ReferenceChunk,
    RobotNames,
)
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.telemetry import ReferenceCodec

JOINTS = ("a", "b", "c")
WHEELS, THRUSTERS = ("wheel_1", "wheel_2", "wheel_3"), ("thruster_1", "thruster_2")
PANELS = ("left", "middle", "right")
EVERYTHING = RobotNames(
    JOINTS, WHEELS, THRUSTERS, PANELS, ("a", "c"), torquers=("torquer_1", "torquer_2")
)
TICKS = 60
Message = tuple[topics.Topic, int, bytes]
"""Topic, tick, data."""


def flown(names: RobotNames, seed: int = 3) -> FlightLog:
    """A flight by hand, another number everywhere."""
    rng = np.random.default_rng(seed)
    log = FlightLog.allocate(TICKS, names, TIMEBASE)
    log.commanded_torque = np.empty((TICKS, len(names.axes)))
    for column in log.columns.values():
        column[:] = rng.normal(size=column.shape)
    return log


def reference(log: FlightLog, joints: tuple[str, ...], start: int = 0) -> list[Message]:
    chunk = ReferenceChunk(start, log.reference_joints, log.reference_base)
    parts = ReferenceCodec(joints, TIMEBASE).encode(chunk)
    return [(topics.REFERENCE_JOINTS, start, parts[0]), (topics.REFERENCE_BASE, start, parts[1])]


def sent(log: FlightLog, names: RobotNames, order: tuple[str, ...] = ()) -> list[Message]:
    """States and commands of each tick."""
    states, order = StateCodec(names, TIMEBASE), order or names.commanded
    commands, found = CommandCodec(order, TIMEBASE), []
    assert log.commanded_torque is not None
    for tick in range(log.ticks):
        asked = np.concatenate((log.commanded_torque[tick], log.actuator_commands[tick]))
        torque = asked[[names.commanded.index(name) for name in order]]
        found.append((topics.COMMAND, tick, commands.encode(Command(tick, torque))))
        parts = zip(states.topics, states.encode(log.state(tick)), strict=True)
        found += [(topic, tick, data) for topic, data in parts]
    return found


def read(
    folder: Path,
    messages: Iterable[Message],
    keep: Callable[[topics.Topic, int], bool] = lambda topic, tick: True,
) -> FlightLog:
    """The flight from a bag of the messages that are kept."""
    recorder = BagRecorder(folder / "bag", {"period": TIMEBASE.period}, TIMEBASE)
    for topic, tick, data in messages:
        if keep(topic, tick):
            recorder.record(topic, data)
    recorder.close()
    return read_flight(folder / "bag")


def assert_same(log: FlightLog, expected: FlightLog) -> None:
    for name in (*ALL_FIELDS, "actuator_commands", "commanded_torque"):
        np.testing.assert_array_equal(getattr(log, name), getattr(expected, name), name)


@pytest.mark.parametrize(
    "names",
    [
        EVERYTHING,
        EVERYTHING._replace(thrusters=(), passive=("left",), geared=JOINTS),
        EVERYTHING._replace(wheels=(), geared=("b",), torquers=()),
        RobotNames(JOINTS),
    ],
)
@pytest.mark.parametrize("reference_first", [True, False])
def test_a_log_has_a_column_for_each(
    names: RobotNames, reference_first: bool, tmp_path: Path
) -> None:
    log = flown(names)
    parts = reference(log, names.joints), sent(log, names)
    back = read(tmp_path, parts[0] + parts[1] if reference_first else parts[1] + parts[0])
    assert_same(back, log)
    assert back.damage == ()
    assert not any(back.lost[topic.full_name] for topic in (*topics.STATES, topics.COMMAND))
    assert (back.joint_names, back.passive_names) == (names.joints, names.passive)
    assert back.geared_names == names.geared
    rows = back.rows(10, 20)
    assert rows.wheel_velocities.shape == (10, len(names.wheels))
    assert rows.passive_velocities.shape == (10, len(names.passive))
    assert rows.motor_velocities.shape == (10, len(names.geared))
    np.testing.assert_array_equal(back.state(9).numbers, log.state(9).numbers)


def test_a_command_of_another_order_is_read_by_name(tmp_path: Path) -> None:
    """Actuators in between the axes; they keep their order."""
    log, actuators = flown(EVERYTHING), EVERYTHING.actuators
    order = (*actuators[:2], *EVERYTHING.axes[::-1], *actuators[2:])
    assert_same(read(tmp_path, reference(log, JOINTS) + sent(log, EVERYTHING, order)), log)


@pytest.mark.parametrize(
    ("topic", "fields"),
    [
        (topics.WHEELS_STATE, ("wheel_velocities", "wheel_torques")),
        (topics.THRUSTERS_STATE, ("thrusts",)),
        (topics.MOTORS_STATE, ("motor_positions", "motor_velocities")),
    ],
    ids=lambda given: getattr(given, "name", ""),
)
def test_a_lost_message_leaves_a_gap_in_its_own_columns(
    topic: topics.Topic, fields: tuple[str, ...], tmp_path: Path
) -> None:
    log, lost = flown(EVERYTHING), (0, 30, TICKS - 1)
    messages = reference(log, JOINTS) + sent(log, EVERYTHING)
    back = read(tmp_path, messages, lambda name, tick: name is not topic or tick not in lost)
    assert back.lost[topic.full_name] == 3
    kept = np.delete(np.arange(TICKS), lost)
    for name in ALL_FIELDS:
        column, true = getattr(back, name), getattr(log, name)
        if name in fields:
            assert np.isnan(column[list(lost)]).all(), name
            column, true = column[kept], true[kept]
        np.testing.assert_array_equal(column, true, name)
    assert back.geared_names == EVERYTHING.geared


def test_actuators_of_another_robot_are_left_out(tmp_path: Path) -> None:
    """More wheels than there may be, motors of no joint."""
    names, foreign = RobotNames(JOINTS), RobotNames(tuple("pqrst"), geared=tuple("pqrst"))
    log, moved, codec = flown(names), flown(foreign), StateCodec(foreign, TIMEBASE)
    wheels = tuple(f"wheel_{k}" for k in range(MOST_WHEELS + 1))
    of_wheels = CommandCodec(wheels, TIMEBASE)  # of the wheels' form: names and efforts
    place, theirs = codec.topics.index(topics.MOTORS_STATE), list[Message]()
    for tick in range(TICKS):
        data = of_wheels.encode(Command(tick, np.zeros(len(wheels))))
        theirs.append((topics.WHEELS_STATE, tick, data))
        theirs.append((topics.MOTORS_STATE, tick, codec.encode(moved.state(tick))[place]))
    back = read(tmp_path, reference(log, JOINTS) + sent(log, names) + theirs)
    assert (back.wheel_velocities.shape, back.geared_names) == ((TICKS, 0), ())
    np.testing.assert_array_equal(back.joint_positions, log.joint_positions)
    assert "on /wheels/state do not fit" in " ".join(back.damage)


def test_joints_without_motors_may_stand_among_the_others(tmp_path: Path) -> None:
    """In a bag of other software, whose publisher has its own order."""
    mixed = RobotNames(("left", "b", "right", "a"))
    log, moved = flown(mixed), flown(RobotNames(("b", "a")))
    back = read(tmp_path, reference(moved, ("b", "a")) + sent(log, mixed))
    assert (back.joint_names, back.passive_names) == (("b", "a"), ("left", "right"))
    np.testing.assert_array_equal(back.joint_positions, log.joint_positions[:, [1, 3]])
    np.testing.assert_array_equal(back.passive_velocities, log.joint_velocities[:, [0, 2]])


def test_the_reference_of_another_robot_tells_nothing(tmp_path: Path) -> None:
    names, other = RobotNames(JOINTS, passive=PANELS), RobotNames(("a", "elbow"))
    log, foreign = flown(names), reference(flown(other), other.joints, 1)
    back = read(tmp_path, [foreign[0], *reference(log, JOINTS), *sent(log, names)])
    assert back.passive_names == PANELS


def test_more_joints_without_motors_than_there_may_be_are_no_robot_of_ours(tmp_path: Path) -> None:
    many = RobotNames((*JOINTS, *(f"panel_{k}" for k in range(MOST_PASSIVE + 1))))
    log = flown(RobotNames(JOINTS))
    with pytest.raises(InputError, match="not one tick"):
        read(tmp_path, reference(log, JOINTS) + sent(flown(many), many))
