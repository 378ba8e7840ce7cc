"""Bags: what we write, against the libraries' readers and a bag of the real ``ros2 bag record``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from paths import DATA
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from rosbags.typesys import get_types_from_msg

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.message_accounting import MessageAccounting, lost_messages
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Command, RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.clock import ClockCodec
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_msgs_py.wire.definitions import definition, jazzy

SAMPLE = DATA / "rosbag2_sample"
TIMEBASE = Timebase(500_000)


@pytest.fixture(scope="module")
def flown(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, FlightLog]:
    bag = tmp_path_factory.mktemp("bags") / "short"
    return bag, simulate(Flight(resolve(FlightPlan(duration=0.2))), bag)


def _mcap(bag: Path) -> Path:
    return next(bag.glob("*.mcap"))


def test_flight_read_back_is_the_flight_flown(flown: tuple[Path, FlightLog]) -> None:
    bag, log = flown
    read = read_flight(bag)
    for column in (
        "quaternion",
        "omega_base",
        "joint_positions",
        "joint_velocities",
        "applied_torque",
        "reference_joints",
        "reference_base",
    ):
        np.testing.assert_array_equal(getattr(read, column), getattr(log, column))
    assert read.flight == log.flight
    assert read.lost == log.lost


def test_rosbags_reads_every_message_with_definitions_from_the_file(
    flown: tuple[Path, FlightLog],
) -> None:
    bag, log = flown
    count = 0
    with AnyReader([bag]) as reader:
        for connection, stamp, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            if connection.topic == "/joint_states":
                sent = message.header.stamp
                assert stamp == sent.sec * 1_000_000_000 + sent.nanosec == count * 500_000
                np.testing.assert_array_equal(message.position, log.joint_positions[count])
                count += 1
    assert count == 400


@pytest.mark.parametrize("topic", topics.ALL, ids=lambda topic: topic.full_name)
def test_definition_parses_to_the_type_it_names(topic: topics.Topic) -> None:
    types = get_types_from_msg(definition(topic.type), topic.type)
    for name, fields in types.items():
        assert fields == jazzy().fielddefs[name]


def test_codecs_decode_what_ros2_bag_recorded() -> None:
    joint_names = tuple(f"joint{i}" for i in range(1, 7))
    states = StateCodec(RobotNames.of(joint_names), TIMEBASE)
    state, decoded = RobotState.allocate(6), 0
    with Reader(SAMPLE) as reader:
        for connection, _, raw in reader.messages():
            message = jazzy().deserialize_cdr(raw, connection.msgtype)
            if connection.topic == "/joint_states":
                names = list(message.name)
                order = [names.index(name) for name in joint_names]
                states.decode(topics.JOINT_STATES, bytes(raw), state)
                np.testing.assert_array_equal(state.joint_positions, message.position[order])
                decoded += 1
            elif connection.topic == "/base/state":
                states.decode(topics.BASE_STATE, bytes(raw), state)
                rotation = message.transforms[0].rotation
                assert state.quaternion.tolist() == [rotation.w, rotation.x, rotation.y, rotation.z]
                decoded += 1
            elif connection.topic == "/command":
                command = Command(-1, np.zeros(len(message.name)))
                CommandCodec(tuple(message.name), TIMEBASE).decode(bytes(raw), command)
                np.testing.assert_array_equal(command.torque, message.effort)
                decoded += 1
    assert decoded == 1200


def test_recorder_counts_what_is_missing_and_drops_what_is_repeated(tmp_path: Path) -> None:
    recorder = BagRecorder(tmp_path / "bag", {}, TIMEBASE)
    codec, state = StateCodec(RobotNames.of(("j",)), TIMEBASE), RobotState.allocate(1)
    for state.tick in (0, 1, 1, 2, 5, 6):
        joints, base = codec.encode(state)
        recorder.record(topics.JOINT_STATES, joints)
        if state.tick != 6:
            recorder.record(topics.BASE_STATE, base)
    for tick in (0, 20, 40, 80, 100):
        recorder.record(topics.CLOCK, ClockCodec().encode(tick * 500_000))
    recorder.close()
    assert recorder.lost["/joint_states"] == 2
    assert recorder.lost["/base/state"] == 3
    assert recorder.lost["/clock"] == 1
    assert recorder.lost["/command"] == 7
    with Reader(tmp_path / "bag") as reader:
        counts = {c.topic: c.msgcount for c in reader.connections}
    assert counts["/joint_states"] == 5


def test_nothing_flown_is_nothing_lost() -> None:
    assert set(lost_messages({t.full_name: MessageAccounting(t) for t in topics.ALL}).values()) == {
        0
    }


def test_bag_is_never_overwritten(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="exists already"):
        BagRecorder(tmp_path.parent, {}, TIMEBASE)


def test_of_two_recorders_for_one_bag_the_first_has_it(tmp_path: Path) -> None:
    """In a folder that was empty, too, as a flight leaves it to its recorder."""
    first = BagRecorder(tmp_path, {}, TIMEBASE)
    with pytest.raises(InputError, match="exists already"):
        BagRecorder(tmp_path, {}, TIMEBASE)
    first.close()
    assert (tmp_path / "metadata.yaml").exists()


def test_unreadable_bag_is_an_input_error(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    simulate(Flight(resolve(FlightPlan(duration=0.01))), bag)
    _mcap(bag).write_bytes(_mcap(bag).read_bytes()[:200])
    with pytest.raises(InputError, match=str(bag)):
        read_flight(bag)


def test_bag_without_a_needed_topic_is_an_input_error() -> None:
    with pytest.raises(InputError, match="no messages on /reference/base"):
        read_flight(SAMPLE)
