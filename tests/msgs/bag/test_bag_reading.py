"""Bags of others, and ours by other writers: the same flight whatever it is stored in."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bags import (
    COLUMNS,
    FLIGHT,
    TIMEBASE,
    Entry,
    Recorded,
    assert_same_flight,
    entries_of,
    mcap_of,
    messages_of,
    record,
    rosbags_bag,
)
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from paths import DATA
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, Writer

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import FLIGHT_KEY
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.definitions import decode, jazzy

SAMPLE = DATA / "rosbag2_sample"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return record(tmp_path_factory.mktemp("whole") / "bag", ticks=200, ticks_a_chunk=50)


@pytest.fixture(scope="module")
def entries(recorded: Recorded) -> list[Entry]:
    return entries_of(recorded.folder)


def _plain(writer: Writer) -> None:
    pass


def _by_message(writer: Writer) -> None:
    writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)


def _by_file(writer: Writer) -> None:
    writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)


@pytest.mark.parametrize("storage", ["mcap", "sqlite"])
@pytest.mark.parametrize("setup", [_plain, _by_message, _by_file])
def test_bag_of_rosbags_is_the_same_flight(
    recorded: Recorded, entries: list[Entry], tmp_path: Path, storage: str, setup: Any
) -> None:
    assert_same_flight(read_flight(rosbags_bag(tmp_path / storage, entries, setup)), recorded.log)


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.NONE},
        {"compression": CompressionType.ZSTD},
        {"compression": CompressionType.LZ4, "chunk_size": 3000},
        {"use_chunking": False},
        {"enable_crcs": False},
        {"use_statistics": False},
        {"repeat_channels": False, "repeat_schemas": False},
    ],
    ids=str,
)
def test_mcap_file_alone_is_the_same_flight_however_it_is_written(
    recorded: Recorded, entries: list[Entry], tmp_path: Path, options: dict[str, Any]
) -> None:
    assert_same_flight(read_flight(mcap_of(tmp_path / "x.mcap", entries, **options)), recorded.log)


def test_file_of_our_bag_alone_is_the_same_flight(recorded: Recorded) -> None:
    log = read_flight(recorded.file)
    assert_same_flight(log, recorded.log)
    assert log.description == FLIGHT
    assert read_flight(recorded.folder / "metadata.yaml").ticks == 200


def test_database_alone_is_the_same_flight(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    folder = rosbags_bag(tmp_path / "sqlite", entries, _plain)
    (file,) = folder.glob("*.db3")
    assert_same_flight(read_flight(file), recorded.log)


def test_our_description_is_read_from_any_storage(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    def describe(writer: Writer) -> None:
        writer.set_custom_data(FLIGHT_KEY, '{"controller": "ctc", "period": 0.0005}')

    log = read_flight(rosbags_bag(tmp_path / "sqlite", entries, describe))
    assert log.flight["controller"] == "ctc"
    assert_same_flight(log, recorded.log)


def test_bag_of_a_big_endian_machine_is_the_same_flight(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    swapped = [
        (
            topic,
            kind,
            log_ns,
            bytes(jazzy().serialize_cdr(decode(data, kind), kind, little_endian=False)),
        )
        for topic, kind, log_ns, data in entries
    ]
    assert {data[:2] for *_, data in swapped} == {b"\0\0"}
    assert_same_flight(read_flight(mcap_of(tmp_path / "x.mcap", swapped)), recorded.log)


def test_a_trajectory_of_unequal_points_is_left_out_and_told(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    """One of its points has one position less than there are joints."""
    at = next(
        i for i, (topic, *_) in enumerate(entries) if topic == topics.REFERENCE_JOINTS.full_name
    )
    topic, kind, log_ns, data = entries[at]
    message = decode(data, kind)
    message.points[1].positions = message.points[1].positions[:-1]
    changed = (topic, kind, log_ns, bytes(jazzy().serialize_cdr(message, kind)))
    log = read_flight(mcap_of(tmp_path / "x.mcap", [*entries[:at], changed, *entries[at + 1 :]]))
    assert log.damage[0] == (
        "1 messages on /reference/joints do not fit "
        "(/reference/joints: a point lacks positions of some joint)"
    )
    assert np.flatnonzero(~log.whole).tolist() == list(range(len(message.points)))


def test_split_bag_is_one_flight(recorded: Recorded, entries: list[Entry], tmp_path: Path) -> None:
    for i in range(11):  # bag_10 comes behind bag_2
        part = slice(i * len(entries) // 11, (i + 1) * len(entries) // 11)
        mcap_of(tmp_path / f"bag_{i}.mcap", entries[part])
    log = read_flight(tmp_path)
    assert log.unfinished == "the bag was not finished: read up to t = 0.0995 s"
    log.unfinished = ""
    assert_same_flight(log, recorded.log)


def test_chunks_in_another_order_are_the_same_flight(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    quarter = len(entries) // 4
    parts = [entries[i : i + quarter] for i in range(0, len(entries), quarter)]
    shuffled = [entry for i in (0, 2, 1, 3, 4) for entry in (parts[i] if i < len(parts) else [])]
    log = read_flight(mcap_of(tmp_path / "x.mcap", shuffled))
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(log, name), getattr(recorded.log, name), name)


# The bag of the real ros2 bag record


def test_messages_of_the_sample_are_those_that_rosbags_reads() -> None:
    ours = list(open_bag(SAMPLE).messages(*topics.ALL))
    with Reader(SAMPLE) as reader:
        theirs = [(c.topic, bytes(raw)) for c, _, raw in reader.messages()]
    for topic in topics.ALL:
        assert [d for n, d in ours if n == topic.full_name] == [
            d for n, d in theirs if n == topic.full_name
        ]
    assert len(ours) == 1208


def completed_sample(recorded: Recorded) -> list[Entry]:
    """The sample, which has no reference of the base, with one."""
    with Reader(SAMPLE) as reader:
        found = [(c.topic, c.msgtype, stamp, bytes(raw)) for c, stamp, raw in reader.messages()]
    topic = topics.REFERENCE_BASE
    missing = [
        (topic.full_name, topic.type, 0, d) for t, d in messages_of(recorded.folder) if t is topic
    ]
    return found + missing


@pytest.mark.parametrize("storage", ["mcap", "sqlite"])
def test_sample_is_read_equally_from_every_storage(
    recorded: Recorded, tmp_path: Path, storage: str
) -> None:
    entries = completed_sample(recorded)
    log = read_flight(rosbags_bag(tmp_path / storage, entries, _plain))
    assert log.damage == ()
    assert log.whole.all()
    by_tick = {
        decode(data, kind).header.stamp.nanosec // TIMEBASE.period_ns: decode(data, kind)
        for name, kind, _, data in entries
        if name == "/joint_states"
    }
    for tick in range(log.ticks):
        np.testing.assert_array_equal(log.joint_positions[tick], by_tick[tick].position)


# Other names, other clocks


def renamed(entries: Sequence[Entry], names: dict[str, str]) -> list[Entry]:
    return [(names.get(n, n), k, stamp, data) for n, k, stamp, data in entries]


def test_topics_are_remapped(recorded: Recorded, entries: list[Entry], tmp_path: Path) -> None:
    names = {"/joint_states": "/arm/joint_states", "/base/state": "/satellite"}
    bag = mcap_of(tmp_path / "x.mcap", renamed(entries, names))
    with pytest.raises(InputError, match=r"no messages on /joint_states .*it has /arm/joint_"):
        read_flight(bag)
    assert_same_flight(read_flight(bag, {v: k for k, v in names.items()}), recorded.log)


def test_a_remapped_topic_stands_for_ours(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    theirs = renamed([e for e in entries if e[0] == "/command"], {"/command": "/raw"})
    without = [e for i, e in enumerate(entries) if e[0] != "/command" or i % 2] + theirs
    log = read_flight(mcap_of(tmp_path / "x.mcap", without), {"/raw": "/command"})
    assert_same_flight(log, recorded.log)


@pytest.mark.parametrize(
    ("remap", "told"),
    [
        ({"/x": "/joint_states"}, "no topic /x to remap; it has /base/state, "),
        ({"/base/state": "/y"}, "unknown topic '/y' to take /base/state for: choose one of"),
        ({"/clock": "/command", "/x": "/command"}, "more than one topic is to be taken for"),
    ],
)
def test_a_remapping_that_makes_no_sense_is_told(
    recorded: Recorded, remap: dict[str, str], told: str
) -> None:
    with pytest.raises(InputError, match=told):
        read_flight(recorded.folder, remap)


def shifted(entries: Iterable[Entry], by_ns: int) -> list[Entry]:
    """All stamps later, in the messages with a header."""
    found = []
    for name, kind, log_ns, data in entries:
        if name not in ("/controller/telemetry", "/clock"):
            head = np.frombuffer(data, np.uint32, 2, 4)
            stamp = int(head[0]) * 1_000_000_000 + int(head[1]) + by_ns
            words = np.array(divmod(stamp, 1_000_000_000), np.uint32).tobytes()
            found.append((name, kind, log_ns, data[:4] + words + data[12:]))
    return found


def test_flight_by_the_clock_of_the_wall_begins_with_its_first_state(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    later = shifted(entries, 1_795_220_105_128_297_452)
    assert_same_flight(read_flight(mcap_of(tmp_path / "x.mcap", later)), recorded.log)


@pytest.mark.parametrize("by_ns", [0, 1_795_220_105_128_297_452])
def test_a_reference_that_begins_before_the_first_state_stays_in_its_place(
    recorded: Recorded, entries: list[Entry], tmp_path: Path, by_ns: int
) -> None:
    """By a recorder that came late, to a flight in simulated time or by the wall clock."""
    first, late = 130, {"/joint_states", "/base/state", "/command"}
    first_ns = first * TIMEBASE.period_ns
    kept = [
        entry
        for entry in entries
        if entry[0] not in late or np.frombuffer(entry[3], np.uint32, 1, 8)[0] >= first_ns
    ]
    log = read_flight(mcap_of(tmp_path / "x.mcap", shifted(kept, by_ns)))
    start = 0 if by_ns else first
    rows = slice(start, start + 200 - first)
    assert log.whole[rows].all()
    for name in COLUMNS:
        np.testing.assert_array_equal(
            getattr(log, name)[rows], getattr(recorded.log, name)[first:], name
        )


def test_period_of_a_bag_of_others_is_that_of_its_stamps(
    recorded: Recorded, tmp_path: Path
) -> None:
    states = (topics.JOINT_STATES, topics.BASE_STATE)
    sent = [(t.full_name, t.type, 0, data) for t, data in messages_of(recorded.folder)]
    every_other = [
        entry
        for entry in sent
        if topics.BY_NAME.get(entry[0]) in states
        and int(np.frombuffer(entry[3], np.uint32, 1, 8)[0]) % 1_000_000 == 0
    ]
    with pytest.raises(InputError, match="no messages on /reference/joints"):
        read_flight(mcap_of(tmp_path / "x.mcap", every_other))
    references = [entry for entry in sent if entry[0].startswith("/reference")]
    with pytest.raises(InputError, match="point 1 is not 1 ticks after its message's stamp"):
        read_flight(mcap_of(tmp_path / "x.mcap", every_other + references))
    assert recorded.log.timebase == Timebase(500_000)


# Latency


def test_latency_is_the_time_between_the_senders(recorded: Recorded, tmp_path: Path) -> None:
    assert recorded.log.latency_s is None
    rng, sent = np.random.default_rng(1), {"/base/state": 0, "/command": 0}
    delays = rng.integers(100_000, 900_000, 200)
    with (tmp_path / "x.mcap").open("wb") as file, recorded.file.open("rb") as source:
        writer = McapWriter(file)
        writer.start("ros2")
        channels: dict[str, int] = {}
        for schema, channel, message in make_reader(source).iter_messages(log_time_order=False):
            assert schema
            topic, publish = channel.topic, message.log_time + 5_000_000_000
            if topic not in channels:
                number = writer.register_schema(schema.name, "ros2msg", schema.data)
                channels[topic] = writer.register_channel(topic, "cdr", number)
            if topic in sent:
                tick, sent[topic] = sent[topic], sent[topic] + 1
                if topic == "/command":
                    publish += int(delays[tick])
                    if tick == 7:
                        continue
            writer.add_message(channels[topic], message.log_time, message.data, publish)
        writer.finish()
    log = read_flight(tmp_path / "x.mcap")
    assert log.latency_s is not None
    assert log.commanded_torque is not None
    expected = delays * 1e-9
    expected[7] = np.nan
    np.testing.assert_allclose(log.latency_s, expected, rtol=1e-12)
    assert np.isnan(log.commanded_torque[7]).all()
    assert log.unanswered == 1


def test_commands_are_those_recorded(recorded: Recorded) -> None:
    log = recorded.log
    assert log.commanded_torque is not None
    np.testing.assert_array_equal(log.commanded_torque[:-1], log.applied_torque[1:])
