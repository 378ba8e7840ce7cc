"""Chunks, compressions and splits, read by the libraries."""

from __future__ import annotations

import json
from pathlib import Path
from typing import get_args

import pytest
import yaml
from bags import as_sent
from hypothesis import given
from hypothesis import strategies as st
from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.records import Message as McapMessage
from mcap.records import MessageIndex
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.chunk import OpenChunk
from space_robot_msgs_py.bag.mcap_file import Compression
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import ACCOUNTS_KEY, FLIGHT_KEY, BagRecorder
from space_robot_msgs_py.bag.writer import DESCRIPTION
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.samples import Timebase

TIMEBASE = Timebase(500_000)
FLIGHT = {"controller": "tde_stc", "period": 0.0005}
SPLIT = 65_536
LATCHED = {"/tf_static", "/robot_description"}
Messages = list[tuple[topics.Topic, bytes]]
"""What the nodes send."""
Message = tuple[str, int, bytes]


def _files(bag: Path) -> list[Path]:
    return sorted(bag.glob("*.mcap"), key=lambda file: int(file.stem.rpartition("_")[2]))


def _read(bag: Path) -> list[Message]:
    """Topic, log time, data of all files, each read on its own by mcap."""
    return [message for file in _files(bag) for message in _read_file(file)]


def _read_file(file: Path) -> list[Message]:
    with file.open("rb") as stream:
        sent = make_reader(stream, validate_crcs=True).iter_messages(log_time_order=False)
        return [(channel.topic, m.log_time, m.data) for _, channel, m in sent]


def _unrepeated(messages: list[Message]) -> list[Message]:
    """Leave out what the later files of a bag repeat."""
    return [m for i, m in enumerate(messages) if i < len(LATCHED) or m[0] not in LATCHED]


def _metadata(file: Path) -> list[tuple[str, dict[str, str]]]:
    with file.open("rb") as stream:
        return [(r.name, r.metadata) for r in make_reader(stream).iter_metadata()]


def _record(bag: Path, messages: Messages, split_size: int = SPLIT) -> BagRecorder:
    recorder = BagRecorder(bag, FLIGHT, TIMEBASE, split_size=split_size)
    for topic, data in messages:
        recorder.record(topic, data)
    return recorder


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    bag = tmp_path_factory.mktemp("plain") / "bag"
    simulate(Flight(resolve(FlightPlan(duration=0.3))), bag)
    return bag


@pytest.fixture(scope="module")
def messages(plain: Path) -> Messages:
    return [as_sent(name, data) for name, _, data in _read(plain)]


@pytest.fixture(scope="module")
def split(messages: Messages, tmp_path_factory: pytest.TempPathFactory) -> Path:
    bag = tmp_path_factory.mktemp("split") / "bag"
    _record(bag, messages).close()
    return bag


MESSAGE = st.tuples(
    st.integers(1, 9),
    st.integers(0, 2**63),
    st.integers(0, 2**63),
    st.integers(0, 2**32 - 1),
    st.binary(max_size=50),
)


@given(st.lists(MESSAGE, min_size=1))
def test_chunk_is_packed_as_mcap_packs_it(messages: list[tuple[int, int, int, int, bytes]]) -> None:
    chunk, builder = OpenChunk(b"before"), RecordBuilder()
    starts: dict[int, list[tuple[int, int]]] = {}
    for channel, log, publish, sequence, data in messages:
        starts.setdefault(channel, []).append((log, len(b"before") + builder.count))
        chunk.add(channel, log, publish, sequence, data)
        McapMessage(channel, log, data, publish, sequence).write(builder)
    assert chunk.content == b"before" + builder.end()
    times = [log for _, log, *_ in messages]
    assert chunk.span_ns == (min(times), max(times))
    assert chunk.counts == {channel: len(found) for channel, found in starts.items()}
    for channel, record in chunk.message_indexes().items():
        MessageIndex(channel, starts[channel]).write(builder)
        assert record == builder.end()


@pytest.mark.parametrize("compression", get_args(Compression))
def test_compressions_hold_the_same_messages(
    plain: Path, compression: Compression, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    simulate(Flight(resolve(FlightPlan(duration=0.3, compression=compression))), bag)
    assert _read(bag) == _read(plain)
    with Reader(bag) as reader:
        assert [bytes(raw) for *_, raw in reader.messages()] == [
            data for _, _, data in sorted(_read(plain), key=lambda message: message[1])
        ]
    with _files(bag)[0].open("rb") as stream:
        summary = make_reader(stream).get_summary()
    assert summary is not None
    assert {i.compression for i in summary.chunk_indexes} == {compression.replace("none", "")}


def test_compression_saves_room(tmp_path: Path) -> None:
    sizes = []
    for compression in ("none", "lz4", "zstd"):
        bag = tmp_path / compression
        simulate(Flight(resolve(FlightPlan(duration=0.3, compression=compression))), bag)
        sizes.append(_files(bag)[0].stat().st_size)
    assert sizes == sorted(sizes, reverse=True)


def test_two_simulated_bags_are_the_same_bytes(tmp_path: Path) -> None:
    for folder in ("a", "b"):
        plan = FlightPlan.model_validate({"duration": 0.3, "split_size": "100K"})
        simulate(Flight(resolve(plan)), tmp_path / folder / "bag")
    first, second = (sorted((tmp_path / folder / "bag").iterdir()) for folder in ("a", "b"))
    assert [file.name for file in first] == [file.name for file in second]
    assert len(first) > 2
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()


def test_splits_hold_every_message_once(split: Path, plain: Path) -> None:
    assert [file.name for file in _files(split)] == [
        f"bag_{number}.mcap" for number in range(len(_files(split)))
    ]
    assert len(_files(split)) > 2
    assert _unrepeated(_read(split)) == _read(plain)
    for file in _files(split)[:-1]:
        assert file.stat().st_size >= SPLIT


def test_every_split_shows_the_robot(split: Path) -> None:
    """The messages of latched topics are the first of each file, at the time it begins."""
    assert {t.recorded.full_name for t in topics.RECORDED if t.recorded.is_latched} == LATCHED
    for file in _files(split):
        sent = _read_file(file)
        assert {name for name, _, _ in sent[:2]} == LATCHED
        assert {stamp for _, stamp, _ in sent[:2]} == {min(stamp for _, stamp, _ in sent)}
        assert not LATCHED & {name for name, _, _ in sent[2:]}
        first = _read_file(_files(split)[0])[:2]
        assert {data for *_, data in sent[:2]} == {data for *_, data in first}


def test_the_end_makes_no_file_of_repeated_messages(messages: Messages, tmp_path: Path) -> None:
    """A file that is full when the flight ends is the last one."""
    bag = tmp_path / "bag"
    recorder = BagRecorder(bag, FLIGHT, TIMEBASE, split_size=SPLIT)
    for topic, data in messages:
        recorder.record(topic, data)
        if _files(bag)[0].stat().st_size >= SPLIT:
            break
    recorder.flush()
    count = len(_files(bag))
    recorder.close()
    assert count == len(_files(bag))
    assert {name for name, *_ in _read_file(_files(bag)[-1])} > {"/joint_states", "/base/state"}


def test_splits_are_in_metadata_with_their_times_and_counts(split: Path) -> None:
    content = yaml.safe_load((split / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert content["relative_file_paths"] == [file.name for file in _files(split)]
    for file, said in zip(_files(split), content["files"], strict=True):
        with file.open("rb") as stream:
            summary = make_reader(stream).get_summary()
        assert summary is not None
        statistics = summary.statistics
        assert statistics is not None
        start = said["starting_time"]["nanoseconds_since_epoch"]
        assert said["path"] == file.name
        assert said["message_count"] == statistics.message_count
        assert start == statistics.message_start_time
        assert start + said["duration"]["nanoseconds"] == statistics.message_end_time
    assert content["message_count"] == sum(said["message_count"] for said in content["files"])


def test_rosbags_and_our_reader_read_splits(split: Path, plain: Path) -> None:
    count = len(_read(plain)) + 2 * (len(_files(split)) - 1)
    with Reader(split) as reader:
        assert len(list(reader.messages())) == reader.message_count == count
    with AnyReader([split]) as any_reader:
        times = [time for _, time, _ in any_reader.messages()]
    assert times == sorted(times)
    assert len(times) == count
    assert read_flight(split).ticks == read_flight(plain).ticks


def test_every_file_says_what_was_flown_and_the_last_what_was_lost(split: Path) -> None:
    for file in _files(split):
        records = _metadata(file)
        assert [name for name, _ in records] == [DESCRIPTION, "rosbag2"] * 2
        for name, content in records:
            if name == "rosbag2":
                content = yaml.safe_load(content["serialized_metadata"])["custom_data"]
            assert json.loads(content[FLIGHT_KEY]) == FLIGHT
    *_, (_, own), (_, rosbag2) = _metadata(_files(split)[-1])
    written = yaml.safe_load((split / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert yaml.safe_load(rosbag2["serialized_metadata"]) == written
    assert own == written["custom_data"]
    for name, counts in json.loads(own[ACCOUNTS_KEY]).items():
        with Reader(split) as reader:
            (connection,) = [c for c in reader.connections if c.topic == name]
        again = len(_files(split)) - 1 if name in LATCHED else 0
        assert counts["received"] == counts["expected"] == connection.msgcount - again
        assert counts["missing"] == counts["repeated"] == counts["invalid_stamps"] == 0


def test_killed_after_a_split_all_before_is_whole(messages: Messages, tmp_path: Path) -> None:
    """The files are as they were when the recorder had made the third."""
    recorder = BagRecorder(tmp_path / "bag", FLIGHT, TIMEBASE, split_size=SPLIT)
    for topic, data in messages:
        recorder.record(topic, data)
        if len(_files(tmp_path / "bag")) == 3:
            break
    *whole, _ = _files(tmp_path / "bag")
    assert len(whole) == 2
    for file in whole:
        with file.open("rb") as stream:
            assert make_reader(stream).get_summary() is not None
    assert read_flight(tmp_path / "bag").ticks == recorder.kept_tick + 1


def test_no_place_for_the_next_file_keeps_those_before(messages: Messages, tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    recorder = BagRecorder(bag, FLIGHT, TIMEBASE, split_size=SPLIT)
    (bag / "bag_2.mcap").write_bytes(b"of somebody else")
    for topic, data in messages:
        recorder.record(topic, data)
    with pytest.raises(FlightError, match="File exists"):
        recorder.close()
    assert recorder.kept_tick > 0
    assert (bag / "bag_2.mcap").read_bytes() == b"of somebody else"
    (bag / "bag_2.mcap").unlink()
    assert len(_unrepeated(_read(bag))) == len(messages) - recorder.unkept
    assert read_flight(bag).ticks == recorder.kept_tick + 1


def test_publish_time_is_the_senders(messages: Messages, tmp_path: Path) -> None:
    recorder = BagRecorder(tmp_path / "bag", FLIGHT, TIMEBASE)
    for number, (topic, data) in enumerate(messages[:50]):
        recorder.record(topic, data, 10**18 + number if number % 2 else 0)
    recorder.close()
    with _files(tmp_path / "bag")[0].open("rb") as stream:
        sent = [m for _, _, m in make_reader(stream).iter_messages(log_time_order=False)]
    for number, message in enumerate(sent):
        known = 10**18 + number
        assert message.publish_time == (known if number % 2 else message.log_time)


def test_bag_without_a_message_is_one(tmp_path: Path) -> None:
    BagRecorder(tmp_path / "bag", FLIGHT, TIMEBASE).close()
    with Reader(tmp_path / "bag") as reader:
        assert reader.message_count == 0
        assert len(reader.connections) == len(topics.RECORDED)
    assert not _read(tmp_path / "bag")


@pytest.mark.parametrize(
    ("parameter", "value", "said"),
    [
        ("compression", "gzip", "'none', 'lz4' or 'zstd', got 'gzip'"),
        ("split_size", "1K", "65536 to 4611686018427387904 bytes"),
        ("split_size", -5, "split_size"),
        ("split_size", "many", "split_size: could not parse .* got 'many'"),
    ],
)
def test_bad_options_are_named(parameter: str, value: object, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Flight(resolve(FlightPlan(parameters={"recorder": {parameter: value}})))


@pytest.mark.parametrize(
    ("given", "size"), [("500K", 500_000), ("100M", 10**8), ("2G", 2 * 10**9), ("1MiB", 2**20)]
)
def test_sizes_as_people_write_them(given: str, size: int) -> None:
    plan = FlightPlan.model_validate({"split_size": given})
    assert Flight(resolve(plan)).scenario.recorder.split_size == size
