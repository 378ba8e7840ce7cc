"""Bags of others, and ours by other writers: the same flight whatever it is stored in."""

from __future__ import annotations

import re
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
    messages_in,
    messages_of,
    record,
    rosbags_bag,
    within,
)
from mcap.writer import CompressionType
from paths import DATA
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, Writer

from space_robot import load_bag
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import FLIGHT_KEY, BagRecorder
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.wire.definitions import decode, jazzy

SAMPLE = DATA / "rosbag2_sample"
WALL_NS = 1_795_220_105_128_297_452


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return record(tmp_path_factory.mktemp("whole") / "bag", ticks=200, ticks_a_chunk=50)


@pytest.fixture(scope="module")
def entries(recorded: Recorded) -> list[Entry]:
    return entries_of(recorded.folder)


# Storages


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
    folder = rosbags_bag(tmp_path / storage, entries, setup)
    assert_same_flight(read_flight(folder), recorded.log)
    if setup is _plain:
        (file,) = (f for f in folder.iterdir() if f.suffix != ".yaml")
        assert_same_flight(read_flight(file), recorded.log)


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


def test_our_description_is_read_from_any_storage(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    def describe(writer: Writer) -> None:
        writer.set_custom_data(FLIGHT_KEY, '{"controller": "ctc", "period": 0.0005}')

    log = read_flight(rosbags_bag(tmp_path / "sqlite", entries, describe))
    assert log.flight["controller"] == "ctc"
    alone = read_flight(recorded.file)
    assert_same_flight(alone, recorded.log)
    assert alone.description == FLIGHT
    assert read_flight(recorded.folder / "metadata.yaml").ticks == 200


def test_bag_of_a_big_endian_machine_is_the_same_flight(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    def swapped(data: bytes, kind: str) -> bytes:
        return bytes(jazzy().serialize_cdr(decode(data, kind), kind, little_endian=False))

    others = [(topic, kind, log_ns, swapped(data, kind)) for topic, kind, log_ns, data in entries]
    assert {data[:2] for *_, data in others} == {b"\0\0"}
    assert_same_flight(read_flight(mcap_of(tmp_path / "x.mcap", others)), recorded.log)


def test_split_bag_and_chunks_in_another_order_are_one_flight(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    (folder := tmp_path / "split").mkdir()
    cuts = [i * len(entries) // 11 for i in range(12)]
    parts = [entries[cuts[i] : cuts[i + 1]] for i in range(11)]
    for i, part in enumerate(parts):  # bag_10 comes behind bag_2
        mcap_of(folder / f"bag_{i}.mcap", part)
    log = read_flight(folder)
    assert log.unfinished == "the bag was not finished: read up to t = 0.0995 s"
    log.unfinished = ""
    assert_same_flight(log, recorded.log)
    shuffled = [entry for i in (0, 2, 1, 5, 3, 4, 6, 8, 7, 9, 10) for entry in parts[i]]
    log = read_flight(mcap_of(tmp_path / "x.mcap", shuffled))
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(log, name), getattr(recorded.log, name), name)


# The bag of the real ros2 bag record


def test_messages_of_the_sample_are_those_that_rosbags_reads() -> None:
    ours = list(messages_in(SAMPLE))
    with Reader(SAMPLE) as reader:
        theirs = [(c.topic, bytes(raw)) for c, _, raw in reader.messages()]
    for topic in topics.ALL:
        mine, others = ([d for n, d in all_of if n == topic.full_name] for all_of in (ours, theirs))
        assert mine == others
    assert len(ours) == 1208
    with pytest.raises(InputError, match="no messages on /reference/base"):
        read_flight(SAMPLE)


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


def recorded_as(
    folder: Path, recorded: Recorded, namespace: str, names: dict[str, str] | None = None
) -> Path:
    """The same messages once more, by our recorder in a namespace."""
    recorder = BagRecorder(folder, FLIGHT, TIMEBASE, names=names, namespace=namespace)
    for topic, data in messages_of(recorded.folder):
        recorder.record(topic, data)
    recorder.close()
    return folder


def test_a_bag_holds_full_names_and_is_read_all_the_same(
    recorded: Recorded, tmp_path: Path
) -> None:
    bag = recorded_as(tmp_path / "bag", recorded, "/fleet/sat1")
    full = {t.recorded.in_namespace("/fleet/sat1") for t in topics.RECORDED}
    assert set(open_bag(bag).topics()) == full
    log = load_bag(bag)
    assert_same_flight(log, recorded.log)
    assert (log.namespace, recorded.log.namespace) == ("/fleet/sat1", "/")
    names = {topic.name: topic.full_name for topic in topics.ALL}
    same = [recorded_as(tmp_path / f"{n is None}" / "bag", recorded, "/", n) for n in (None, names)]
    assert len({next(bag.glob("*.mcap")).read_bytes() for bag in same}) == 1


def test_topics_that_were_remapped_are_found_by_what_the_recorder_noted(
    recorded: Recorded, tmp_path: Path
) -> None:
    names = {topic.name: topic.in_namespace("/sat1") for topic in topics.ALL}
    names |= {"joint_states": "/arm/measured", "clock": "/clock"}
    bag = recorded_as(tmp_path / "bag", recorded, "/sat1", names)
    for remap in (None, {"/sat1/command": "/command"}):  # beside what was noted
        log = read_flight(bag, remap)
        assert_same_flight(log, recorded.log)
        assert log.namespace == "/sat1"


def test_of_several_robots_one_is_to_be_chosen(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    """As `ros2 bag record -a` takes them, in one bag."""
    other = [entry for entry in entries if entry[0] != "/command"]
    both = sorted([*within("/sat1", entries), *within("/sat2", other)], key=lambda e: e[2])
    bag = mcap_of(tmp_path / "x.mcap", both)
    told = "robots of 2 namespaces, /sat1, /sat2: choose one (--namespace)"
    with pytest.raises(InputError, match=re.escape(told)):
        read_flight(bag)
    assert_same_flight(read_flight(bag, namespace="sat1"), recorded.log)
    second = read_flight(bag, namespace="/sat2/")
    assert (second.commanded_torque, second.namespace) == (None, "/sat2")
    with pytest.raises(InputError, match="no robot in namespace /sat3; it has /sat1, /sat2"):
        read_flight(bag, namespace="sat3")
    bag = mcap_of(tmp_path / "y.mcap", [*entries, *within("/sat1", entries)])
    with pytest.raises(InputError, match="robots of 2 namespaces, /, /sat1"):
        read_flight(bag)
    assert_same_flight(read_flight(bag, namespace="/"), recorded.log)


def test_topics_alike_do_not_make_a_robot(
    recorded: Recorded, entries: list[Entry], tmp_path: Path
) -> None:
    """Joint states of another machine, and a topic whose type is another."""
    arm = [e for e in within("/arm", entries) if e[0].endswith("joint_states")]
    wrong = [(f"/x{n}", "std_msgs/msg/String", stamp, d) for n, _, stamp, d in entries]
    found = read_flight(mcap_of(tmp_path / "x.mcap", [*arm, *wrong, *entries]))
    assert_same_flight(found, recorded.log)
    with pytest.raises(InputError, match=r"no messages on /base/state .*it has /arm/joint_states"):
        read_flight(mcap_of(tmp_path / "y.mcap", arm))


def stamp_of(entry: Entry) -> int:
    seconds, rest = np.frombuffer(entry[3], np.uint32, 2, 4)
    return int(seconds) * 1_000_000_000 + int(rest)


def shifted(entries: Iterable[Entry], by_ns: int) -> list[Entry]:
    """All stamps later, in the messages with a header."""
    found = []
    for entry in entries:
        name, kind, log_ns, data = entry
        if name not in ("/controller/telemetry", "/clock"):
            words = np.array(divmod(stamp_of(entry) + by_ns, 1_000_000_000), np.uint32).tobytes()
            found.append((name, kind, log_ns, data[:4] + words + data[12:]))
    return found


@pytest.mark.parametrize("by_ns", [0, WALL_NS])
@pytest.mark.parametrize("first", [0, 130])
def test_a_flight_by_any_clock_begins_with_its_first_state(
    recorded: Recorded, entries: list[Entry], tmp_path: Path, first: int, by_ns: int
) -> None:
    """Also by a recorder that came late: a reference from before stays in its place."""
    late, first_ns = {"/joint_states", "/base/state", "/command"}, first * TIMEBASE.period_ns
    kept = [entry for entry in entries if entry[0] not in late or stamp_of(entry) >= first_ns]
    log = read_flight(mcap_of(tmp_path / "x.mcap", shifted(kept, by_ns)))
    start = 0 if by_ns else first
    rows = slice(start, start + 200 - first)
    assert log.whole[rows].all()
    for name in COLUMNS:
        column, true = getattr(log, name), getattr(recorded.log, name)
        np.testing.assert_array_equal(column[rows], true[first:], name)


def test_latency_is_the_time_between_the_senders(recorded: Recorded, tmp_path: Path) -> None:
    assert recorded.log.latency_s is None
    delays = np.random.default_rng(1).integers(100_000, 900_000, 200)
    recorder, answered = BagRecorder(tmp_path / "bag", FLIGHT, TIMEBASE), 0
    for topic, data in messages_of(recorded.folder):
        published = TIMEBASE.period_ns * answered + 5_000_000_000
        if topic is topics.COMMAND:
            published += int(delays[answered])
            answered += 1
            if answered == 8:
                continue
        recorder.record(topic, data, published)
    recorder.close()
    log = read_flight(tmp_path / "bag")
    assert log.latency_s is not None
    assert log.commanded_torque is not None
    expected = delays * 1e-9
    expected[7] = np.nan
    np.testing.assert_allclose(log.latency_s, expected, rtol=1e-12)
    assert np.isnan(log.commanded_torque[7]).all()
    assert log.unanswered == 1
    assert recorded.log.commanded_torque is not None
    np.testing.assert_array_equal(
        recorded.log.commanded_torque[:-1], recorded.log.applied_torque[1:]
    )


# The arrays of a log


def test_longest_stretch_is_the_longest_without_a_gap(recorded: Recorded) -> None:
    log = load_bag(recorded.folder)
    assert log.longest_stretch().ticks == 200
    log.quaternion[50], log.reference_base[175] = np.nan, np.nan
    assert np.flatnonzero(~log.whole).tolist() == [50, 175]
    stretch = log.longest_stretch()
    assert isinstance(stretch, FlightLog)
    assert (stretch.first_tick, stretch.ticks) == (51, 124)
    assert stretch.whole.all()
    assert stretch.time[0] == pytest.approx(0.0255)
    log.joint_positions[:] = np.nan
    assert log.longest_stretch().ticks == 0
