"""Bags that we write, read by the mcap library, by rosbags and by ourselves."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, get_args

import pytest
import yaml
from bags import as_sent, read_accounts
from mcap.reader import make_reader
from paths import DATA
from robots import driven_paper
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.simulate import simulate
from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.message_accounting import MessageAccounting, lost_messages
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import ACCOUNTS_KEY, FLIGHT_KEY, BagRecorder
from space_robot_msgs_py.bag.writer import DESCRIPTION, Compression
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.codecs import StateCodec
from space_robot_msgs_py.wire.telemetry import ClockCodec

TIMEBASE = Timebase(500_000)
FLIGHT = {"controller": "tde_stc", "period": 0.0005}
SPLIT = 65_536
LATCHED = {"/tf_static", "/robot_description"}
SAMPLE = DATA / "rosbag2_sample" / "metadata.yaml"
Messages = list[tuple[topics.Topic, bytes]]
"""What the nodes send."""
Message = tuple[str, int, bytes]


def _files(bag: Path) -> list[Path]:
    return sorted(bag.glob("*.mcap"), key=lambda file: int(file.stem.rpartition("_")[2]))


def _read_file(file: Path) -> list[Message]:
    """Topic, log time, data, as mcap reads them."""
    with file.open("rb") as stream:
        sent = make_reader(stream, validate_crcs=True).iter_messages(log_time_order=False)
        return [(channel.topic, m.log_time, m.data) for _, channel, m in sent]


def _read(bag: Path) -> list[Message]:
    return [message for file in _files(bag) for message in _read_file(file)]


def _unrepeated(messages: list[Message]) -> list[Message]:
    """Leave out what the later files of a bag repeat."""
    return [m for i, m in enumerate(messages) if i < len(LATCHED) or m[0] not in LATCHED]


def _summary(file: Path) -> Any:
    with file.open("rb") as stream:
        return make_reader(stream).get_summary()


def _information(bag: Path) -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load((bag / "metadata.yaml").read_text())
    assert list(content) == ["rosbag2_bagfile_information"]
    return dict(content["rosbag2_bagfile_information"])


# Whole flights

OF_HARDWARE = {
    *(topics.WHEELS_STATE, topics.THRUSTERS_STATE, topics.MOTORS_STATE),
    *(topics.MAGNETOMETER, topics.TRUTH_ORBIT),
}
FLIGHTS: dict[str, tuple[dict[str, Any], set[topics.Topic]]] = {
    "paper": ({"robot": "paper"}, OF_HARDWARE),
    "in_orbit": (
        {
            "robot": Robot.from_dict(driven_paper()),
            "orbit": "iss",
            "actuators": "wheels_and_torquers",
        },
        {topics.THRUSTERS_STATE},
    ),
}
"""Options of each flight, and the topics that it does not have."""


@pytest.fixture(scope="module", params=FLIGHTS)
def bag(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bags") / request.param
    options = {"duration": 0.1, "sensors": "fine", **FLIGHTS[request.param][0]}
    simulate(Flight(resolve(Scenario.model_validate(options))), folder)
    return folder


def _types_in(bag: Path) -> Typestore:
    """Of the definitions in the bag alone."""
    store = get_typestore(Stores.EMPTY)
    for schema in _summary(_files(bag)[0]).schemas.values():
        types = get_types_from_msg(schema.data.decode(), schema.name)
        store.register({n: fields for n, fields in types.items() if n not in store.fielddefs})
    return store


def test_every_message_serialised_again_is_the_same_bytes(bag: Path) -> None:
    """By rosbags with the definitions in the bag, whose hashes are those the bag tells."""
    store, seen = _types_in(bag), set()
    with Reader(bag) as reader:
        for connection in reader.connections:
            assert store.hash_rihs01(connection.msgtype) == connection.digest
        for connection, stamp, raw in reader.messages():
            message = store.deserialize_cdr(raw, connection.msgtype)
            assert bytes(store.serialize_cdr(message, connection.msgtype)) == bytes(raw)
            seen.add(connection.topic)
            if connection.topic == "/joint_states":
                assert stamp == message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
    absent = FLIGHTS[bag.name][1]
    assert seen == {t.recorded.full_name for t in topics.RECORDED if t not in absent}


# Chunks, compressions, splits


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    bag = tmp_path_factory.mktemp("plain") / "bag"
    simulate(Flight(resolve(Scenario(duration=0.3))), bag)
    return bag


@pytest.fixture(scope="module")
def messages(plain: Path) -> Messages:
    return [as_sent(name, data) for name, _, data in _read(plain)]


@pytest.fixture(scope="module")
def split(messages: Messages, tmp_path_factory: pytest.TempPathFactory) -> Path:
    bag = tmp_path_factory.mktemp("split") / "bag"
    recorder = BagRecorder(bag, FLIGHT, TIMEBASE, split_size=SPLIT)
    for message in messages:
        recorder.record(*message)
    recorder.close()
    return bag


def test_compressions_hold_the_same_messages_in_less_room(plain: Path, tmp_path: Path) -> None:
    sizes = {}
    for compression in get_args(Compression):
        bag = tmp_path / compression
        simulate(Flight(resolve(Scenario(duration=0.3, compression=compression))), bag)
        assert _read(bag) == _read(plain)
        with Reader(bag) as reader:
            assert [bytes(raw) for *_, raw in reader.messages()] == [
                data for _, _, data in sorted(_read(plain), key=lambda message: message[1])
            ]
        kinds = {index.compression for index in _summary(_files(bag)[0]).chunk_indexes}
        assert kinds == {compression.replace("none", "")}
        sizes[compression] = _files(bag)[0].stat().st_size
    assert sizes["none"] > sizes["lz4"] > sizes["zstd"]


def test_splits_hold_every_message_once_and_each_shows_the_robot(split: Path, plain: Path) -> None:
    """The messages of latched topics are the first of each file, at the time it begins."""
    files = _files(split)
    assert [file.name for file in files] == [f"bag_{k}.mcap" for k in range(len(files))]
    assert len(files) > 2
    assert _unrepeated(_read(split)) == _read(plain)
    assert all(file.stat().st_size >= SPLIT for file in files[:-1])
    assert {t.recorded.full_name for t in topics.RECORDED if t.recorded.is_latched} == LATCHED
    first = _read_file(files[0])[:2]
    for file in files:
        sent = _read_file(file)
        assert {name for name, _, _ in sent[:2]} == LATCHED
        assert {stamp for _, stamp, _ in sent[:2]} == {min(stamp for _, stamp, _ in sent)}
        assert not LATCHED & {name for name, _, _ in sent[2:]}
        assert {data for *_, data in sent[:2]} == {data for *_, data in first}
    count = len(_read(plain)) + 2 * (len(files) - 1)
    with Reader(split) as reader:
        assert reader.message_count == count
    with AnyReader([split]) as any_reader:
        times = [time for _, time, _ in any_reader.messages()]
    assert times == sorted(times)
    information = _information(split)
    assert information["starting_time"] == {"nanoseconds_since_epoch": times[0]}
    assert information["duration"] == {"nanoseconds": times[-1] - times[0]}
    assert len(times) == count
    assert read_flight(split).ticks == read_flight(plain).ticks


def test_every_file_says_what_was_flown_and_the_last_what_was_lost(split: Path) -> None:
    for file in _files(split):
        with file.open("rb") as stream:
            records = [(r.name, r.metadata) for r in make_reader(stream).iter_metadata()]
        assert [name for name, _ in records] == [DESCRIPTION, "rosbag2"] * 2
        for name, content in records:
            if name == "rosbag2":
                content = yaml.safe_load(content["serialized_metadata"])["custom_data"]
            assert json.loads(content[FLIGHT_KEY]) == FLIGHT
    *_, (_, own), (_, rosbag2) = records
    written = _information(split)
    assert yaml.safe_load(rosbag2["serialized_metadata"]) == written
    assert own == written["custom_data"]
    with Reader(split) as reader:
        counted = {connection.topic: connection.msgcount for connection in reader.connections}
    for name, counts in json.loads(own[ACCOUNTS_KEY]).items():
        again = len(_files(split)) - 1 if name in LATCHED else 0
        assert counts["received"] == counts["expected"] == counted[name] - again
        assert counts["missing"] == counts["repeated"] == counts["invalid_stamps"] == 0


def test_no_place_for_the_next_file_keeps_those_before(messages: Messages, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    recorder = BagRecorder(bag, FLIGHT, TIMEBASE, split_size=SPLIT)
    (bag / "bag_2.mcap").write_bytes(b"of somebody else")
    for topic, data in messages:
        recorder.record(topic, data)
    with pytest.raises(FlightError, match="File exists"):
        recorder.close()
    assert (bag / "bag_2.mcap").read_bytes() == b"of somebody else"
    (bag / "bag_2.mcap").unlink()
    assert len(_unrepeated(_read(bag))) == len(messages) - recorder.unkept
    assert 0 < recorder.kept_tick == read_flight(bag).ticks - 1


def test_recorder_counts_what_is_missing_and_drops_what_is_repeated(tmp_path: Path) -> None:
    recorder = BagRecorder(tmp_path / "bag", {}, TIMEBASE)
    codec, state = StateCodec(RobotNames(("j",)), TIMEBASE), RobotState.allocate(1)
    for state.tick in (0, 1, 1, 2, 5, 6):
        joints, base = codec.encode(state)
        recorder.record(topics.JOINT_STATES, joints)
        if state.tick != 6:
            recorder.record(topics.BASE_STATE, base)
    for tick in (0, 20, 40, 80, 100):
        recorder.record(topics.CLOCK, ClockCodec().encode(tick * 500_000))
    recorder.close()
    lost = [recorder.lost[name] for name in ("/joint_states", "/base/state", "/clock", "/command")]
    assert lost == [2, 3, 1, 7]
    with Reader(tmp_path / "bag") as reader:
        counts = {c.topic: c.msgcount for c in reader.connections}
    assert counts["/joint_states"] == 5
    assert read_accounts(tmp_path / "bag")["/joint_states"]["repeated"] == 1
    nothing = lost_messages({t.full_name: MessageAccounting(t) for t in topics.ALL})
    assert set(nothing.values()) == {0}


def test_a_bag_is_never_overwritten_and_of_two_recorders_the_first_has_it(tmp_path: Path) -> None:
    """In a folder that was empty, too, as a flight leaves it to its recorder."""
    first = BagRecorder(tmp_path / "bag", {}, TIMEBASE)
    for taken in (tmp_path / "bag", tmp_path):
        with pytest.raises(InputError, match="exists already"):
            BagRecorder(taken, {}, TIMEBASE)
    first.close()
    with Reader(tmp_path / "bag") as reader:
        assert reader.message_count == 0
        assert len(reader.connections) == len(topics.RECORDED)


@pytest.mark.parametrize(
    ("given", "size"), [("500K", 500_000), ("100M", 10**8), ("2G", 2 * 10**9), ("1MiB", 2**20)]
)
def test_sizes_as_people_write_them(given: str, size: int) -> None:
    plan = Scenario.model_validate({"split_size": given})
    assert Flight(resolve(plan)).scenario.recorder.split_size == size


def _keys(value: Any) -> list[Any]:
    if isinstance(value, dict):
        return [key for pair in value.items() for key in (pair[0], *_keys(pair[1]))]
    return _keys(value[0]) if isinstance(value, list) and value else []


def test_metadata_has_the_keys_of_rosbag2(plain: Path) -> None:
    ours, theirs = ({**_information(b), "custom_data": None} for b in (plain, SAMPLE.parent))
    assert _keys(ours) == _keys(theirs)
