"""Joints without motors in bags: known by the reference, which moves the others alone."""

from __future__ import annotations

from collections.abc import Iterator
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
    PASSIVE_FIELDS,
    STATE_FIELDS,
    ReferenceChunk,
    RobotNames,
)
from space_robot_msgs_py.wire.codecs import StateCodec
from space_robot_msgs_py.wire.reference_codec import ReferenceCodec
from space_robot_msgs_py.wire.truth_writer import TruthWriter

NAMES = RobotNames(("a", "b"), passive=("left", "middle", "right"))
TICKS = 60
Message = tuple[topics.Topic, bytes]


def flown(names: RobotNames = NAMES, seed: int = 3) -> FlightLog:
    """A flight by hand, another number everywhere."""
    rng = np.random.default_rng(seed)
    log = FlightLog.allocate(TICKS, names.joints, TIMEBASE, passive_names=names.passive)
    for column in log.columns.values():
        column[:] = rng.normal(size=column.shape)
    return log


def reference_of(log: FlightLog, joints: tuple[str, ...], start: int = 0) -> list[Message]:
    chunk = ReferenceChunk(start, log.reference_joints, log.reference_base)
    parts = ReferenceCodec(joints, TIMEBASE).encode(chunk)
    return list(zip((topics.REFERENCE_JOINTS, topics.REFERENCE_BASE), parts, strict=True))


def states_of(log: FlightLog, names: RobotNames = NAMES) -> Iterator[Message]:
    codec = StateCodec(names, TIMEBASE)
    for tick in range(log.ticks):
        yield from zip(codec.topics, codec.encode(log.state(tick)), strict=True)


def truth_of(log: FlightLog) -> Iterator[Message]:
    writer = TruthWriter(NAMES, TIMEBASE, topics.TRUTH)
    for tick in range(log.ticks):
        yield from writer.add(log.state(tick))
    yield from writer.flush()


def read(folder: Path, messages: list[Message], faults: list[str] | None = None) -> FlightLog:
    flight = {"period": TIMEBASE.period, "faults": faults or []}
    recorder = BagRecorder(folder / "bag", flight, TIMEBASE)
    for message in messages:
        recorder.record(*message)
    recorder.close()
    return read_flight(folder / "bag")


@pytest.mark.parametrize("comes_first", [True, False], ids=["before", "behind"])
def test_a_log_has_a_column_for_each(comes_first: bool, tmp_path: Path) -> None:
    log = flown()
    reference, states = reference_of(log, NAMES.joints), list(states_of(log))
    found = read(tmp_path, reference + states if comes_first else states + reference)
    assert found.joint_names == NAMES.joints
    assert found.passive_names == NAMES.passive
    for name in ALL_FIELDS:
        np.testing.assert_array_equal(getattr(found, name), getattr(log, name), name)
    assert not found.damage
    assert found.rows(10, 20).passive_velocities.shape == (10, 3)
    np.testing.assert_array_equal(found.state(9).numbers, log.state(9).numbers)


def test_a_robot_without_them_has_no_column(tmp_path: Path) -> None:
    names = RobotNames(("a", "b"))
    log = flown(names)
    found = read(tmp_path, [*reference_of(log, names.joints), *states_of(log, names)])
    assert found.passive_names == ()
    for name in PASSIVE_FIELDS:
        assert getattr(found, name).shape == (TICKS, 0)


def test_they_may_stand_among_the_others(tmp_path: Path) -> None:
    """In a bag of other software, whose publisher has its own order."""
    mixed = RobotNames(("left", "b", "right", "a"))
    log = flown(mixed)
    moved = flown(RobotNames(("b", "a")))
    found = read(tmp_path, [*reference_of(moved, ("b", "a")), *states_of(log, mixed)])
    assert found.joint_names == ("b", "a")
    assert found.passive_names == ("left", "right")
    np.testing.assert_array_equal(found.joint_positions, log.joint_positions[:, [1, 3]])
    np.testing.assert_array_equal(found.passive_velocities, log.joint_velocities[:, [0, 2]])


def test_the_reference_of_another_robot_tells_nothing(tmp_path: Path) -> None:
    log, other = flown(), RobotNames(("a", "elbow"))
    foreign = reference_of(flown(other), other.joints, 1)
    found = read(tmp_path, [foreign[0], *reference_of(log, NAMES.joints), *states_of(log)])
    assert found.passive_names == NAMES.passive


def test_their_true_motion_stands_beside_what_was_told(tmp_path: Path) -> None:
    log, told = flown(), flown(seed=4)
    found = read(tmp_path, [*reference_of(log, NAMES.joints), *states_of(told), *truth_of(log)])
    assert found.measured is not None
    for name in PASSIVE_FIELDS:
        np.testing.assert_array_equal(getattr(found, name), getattr(log, name), name)
        np.testing.assert_array_equal(getattr(found.measured, name), getattr(told, name), name)
    assert found.as_measured().passive_positions is found.measured.passive_positions


def test_a_state_that_a_fault_kept_back_is_filled_whole(tmp_path: Path) -> None:
    log = flown()
    states = [m for i, m in enumerate(states_of(log)) if i // 2 != 50]
    found = read(tmp_path, [*reference_of(log, NAMES.joints), *states], ["drop_state@0"])
    assert found.filled == 1
    for name in (*STATE_FIELDS, *PASSIVE_FIELDS):
        np.testing.assert_array_equal(getattr(found, name)[50], getattr(log, name)[49], name)


def test_more_than_there_may_be_are_no_robot_of_ours(tmp_path: Path) -> None:
    many = RobotNames(("a", "b", *(f"panel_{k}" for k in range(MOST_PASSIVE + 1))))
    log = flown(RobotNames(("a", "b")))
    with pytest.raises(InputError, match="not one tick"):
        read(tmp_path, [*reference_of(log, ("a", "b")), *states_of(flown(many), many)])
