"""Bags that are broken in one way each: what is readable is read, and the rest is told."""

from __future__ import annotations

import os
import shutil
import socket
import sqlite3
from pathlib import Path

import numpy as np
import pytest
import yaml
from bags import (
    COLUMNS,
    FLIGHT,
    TIMEBASE,
    Recorded,
    assert_rows_are_the_originals,
    chunks_of,
    entries_of,
    mcap_file,
    messages_of,
    record,
    rosbags_bag,
)
from mcap.writer import Writer as McapWriter

from space_robot.analysis import analyze
from space_robot.analysis.report_tables import rms_table
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.wire.clock import ClockCodec

METADATA = "metadata.yaml"


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return record(tmp_path_factory.mktemp("whole") / "bag")


@pytest.fixture
def bag(recorded: Recorded, tmp_path: Path) -> Path:
    return recorded.copy(tmp_path / "bag")


def _flip(file: Path, at: int) -> None:
    content = bytearray(file.read_bytes())
    content[at] ^= 0x10
    file.write_bytes(content)


def _edit(bag: Path, **changes: object) -> None:
    content = yaml.safe_load((bag / METADATA).read_text())
    content["rosbag2_bagfile_information"].update(changes)
    (bag / METADATA).write_text(yaml.safe_dump(content))


def test_a_whole_bag_has_no_damage(recorded: Recorded) -> None:
    log = recorded.log
    assert (log.ticks, log.damage, log.unfinished) == (400, (), "")
    assert log.whole.all()
    assert not any(log.lost.values())


@pytest.mark.parametrize("which", [0, 1, 2, 3])
def test_a_broken_chunk_is_left_out_and_the_others_read(
    recorded: Recorded, bag: Path, which: int
) -> None:
    start, length = chunks_of(bag)[which]
    _flip(mcap_file(bag), start + length // 2)
    log = read_flight(bag)
    gone = np.zeros(400, np.bool_)
    gone[100 * which : 100 * which + 100] = True
    np.testing.assert_array_equal(log.whole, ~gone[: log.ticks])
    assert_rows_are_the_originals(log, recorded.log)
    assert log.ticks == (300 if which == 3 else 400)
    for topic in (topics.JOINT_STATES, topics.BASE_STATE, topics.COMMAND):
        assert log.lost[topic.full_name] == 100
    assert not log.unfinished
    told = " ".join(log.damage)
    assert f"bag_0.mcap: unreadable at byte {start} " in told
    assert "recorded messages cannot be read" in told
    assert "/joint_states 100" in told
    if which < 3:
        span = f"t = {0.05 * which:.4f} to {0.05 * which + 0.0495:.4f} s"
        assert f"100 of 400 ticks lack state or reference: {span}" in told


def test_a_flight_with_a_gap_is_analysed_where_it_has_none(recorded: Recorded, bag: Path) -> None:
    start, length = chunks_of(bag)[1]
    _flip(mcap_file(bag), start + length // 2)
    log = read_flight(bag)
    report, whole = analyze(log), analyze(recorded.log)
    assert (report["from_s"], report["to_s"]) == (0.1, 0.2)
    assert all(np.isfinite(value) for value in report["rms"]["mean_axis"].values())
    told = "analyzed from t = 0.1000 to 0.1995 s, the longest stretch without a gap"
    assert report["damage"] == [*log.damage, told]
    assert whole["damage"] == []
    assert "50.0% of the flight, 200 of 400 ticks, 0.1 s" in rms_table(report).title
    assert rms_table(whole).title.endswith(": 400 ticks, 0.2 s")
    log.quaternion[:] = np.nan
    with pytest.raises(InputError, match="no tick has both a state and a reference"):
        analyze(log)


def test_a_broken_length_loses_its_own_chunk_only(recorded: Recorded, bag: Path) -> None:
    start, _ = chunks_of(bag)[1]
    for byte in (1, 4, 8):
        _flip(mcap_file(bag), start + byte)
    log = read_flight(bag)
    assert (log.ticks, np.count_nonzero(log.whole)) == (400, 300)
    assert_rows_are_the_originals(log, recorded.log)


def test_bytes_cut_out_or_put_in_lose_what_they_touch(recorded: Recorded, bag: Path) -> None:
    content = mcap_file(bag).read_bytes()
    (one, _), (two, _) = chunks_of(bag)[1:3]
    for broken in (
        content[: one + 100] + content[one + 300 :],
        content[: one + 100] + b"\x07" * 777 + content[one + 100 :],
        content[:one] + bytes(5000) + content[two:],
    ):
        mcap_file(bag).write_bytes(broken)
        log = read_flight(bag)
        assert (log.ticks, np.count_nonzero(log.whole)) == (400, 300)
        assert_rows_are_the_originals(log, recorded.log)


def test_a_broken_index_loses_nothing(recorded: Recorded, bag: Path) -> None:
    _flip(mcap_file(bag), mcap_file(bag).stat().st_size - 60)
    log = read_flight(bag)
    assert log.whole.all()
    assert log.ticks == 400
    assert log.damage == ("bag_0.mcap: its index cannot be read (CRC)",)
    assert not any(log.lost.values())
    assert_rows_are_the_originals(log, recorded.log)


def test_a_missing_footer_is_an_unfinished_bag(recorded: Recorded, bag: Path) -> None:
    content = mcap_file(bag).read_bytes()
    mcap_file(bag).write_bytes(content[:-40])
    log = read_flight(bag)
    assert log.ticks == 400
    assert log.unfinished
    assert not any(log.lost.values())


def test_a_lost_beginning_is_made_up_for_by_the_index(recorded: Recorded, bag: Path) -> None:
    content = mcap_file(bag).read_bytes()
    first, _ = chunks_of(bag)[1]
    mcap_file(bag).write_bytes(b"\xaa" * first + content[first:])
    log = read_flight(bag)
    assert np.count_nonzero(log.whole) == 300
    assert not log.whole[:100].any()
    assert log.longest_stretch().time[0] == 0.05
    assert_rows_are_the_originals(log, recorded.log)


# metadata.yaml


def test_metadata_that_cannot_be_read_costs_nothing(recorded: Recorded, bag: Path) -> None:
    whole = (bag / METADATA).read_bytes()
    for broken in (whole[:200], b"", b"\xff\xfe\x00", b"a: [", b"? [a]\n: b", b"[" * 9000):
        (bag / METADATA).write_bytes(broken)
        log = read_flight(bag)
        assert len(log.damage) == 1
        assert METADATA in log.damage[0]
        assert (log.ticks, log.unfinished, log.flight) == (400, "", FLIGHT)


def test_metadata_with_other_counts_is_not_believed(bag: Path) -> None:
    counts = yaml.safe_load((bag / METADATA).read_text())["rosbag2_bagfile_information"]
    (joints,) = (
        entry
        for entry in counts["topics_with_message_count"]
        if entry["topic_metadata"]["name"] == "/joint_states"
    )
    joints["message_count"] = 399
    _edit(bag, topics_with_message_count=counts["topics_with_message_count"])
    log = read_flight(bag)
    assert log.damage == ("metadata.yaml: 399 messages on /joint_states, but 400 in the bag",)
    assert not any(log.lost.values())


def test_metadata_with_another_duration_is_not_believed(bag: Path) -> None:
    _edit(bag, duration={"nanoseconds": 5_000_000_000})
    (told,) = read_flight(bag).damage
    assert told == "metadata.yaml: messages from 0 to 5 s, but 0 to 0.1995 s in the bag"


def test_a_file_that_metadata_does_not_name_is_left_out(recorded: Recorded, bag: Path) -> None:
    shutil.copy(mcap_file(bag), bag / "other.mcap")
    log = read_flight(bag)
    assert log.damage == ("metadata.yaml does not name other.mcap: left out",)
    assert_rows_are_the_originals(log, recorded.log)


def test_a_renamed_file_is_read(bag: Path) -> None:
    mcap_file(bag).rename(bag / "other.mcap")
    log = read_flight(bag)
    assert log.ticks == 400
    assert any("names bag_0.mcap, not there" in text for text in log.damage)


def test_a_missing_split_file_is_told_and_its_messages_are_lost(
    recorded: Recorded, bag: Path
) -> None:
    _edit(bag, relative_file_paths=["bag_0.mcap", "bag_1.mcap"])
    information = yaml.safe_load((bag / METADATA).read_text())["rosbag2_bagfile_information"]
    for entry in information["topics_with_message_count"]:
        entry["message_count"] *= 2
    _edit(bag, topics_with_message_count=information["topics_with_message_count"])
    log = read_flight(bag)
    assert any("bag_1.mcap, not there" in text for text in log.damage)
    assert log.lost["/joint_states"] == 400
    assert_rows_are_the_originals(log, recorded.log)


# One line


def _error(path: Path, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        read_flight(path, **options)
    line = str(caught.value)
    assert str(path) in line
    assert "\n" not in line
    return line


def test_what_is_no_bag_is_told_in_a_line(bag: Path, tmp_path: Path) -> None:
    assert "no such bag" in _error(tmp_path / "nothing")
    (tmp_path / "empty").mkdir()
    assert "not a bag folder" in _error(tmp_path / "empty")
    text = tmp_path / "notes.txt"
    text.write_text("no bag")
    assert "neither .mcap nor .db3" in _error(text)
    for content in (b"", b"no bag at all", os.urandom(3000)):
        (tmp_path / "x.mcap").write_bytes(content)
        assert "no messages on /joint_states" in _error(tmp_path / "x.mcap")
    mcap_file(bag).unlink()
    assert "names bag_0.mcap, not there" in _error(bag)
    (bag / "bag_0.mcap").mkdir()
    assert "cannot be read (Is a directory)" in _error(bag)


def test_an_empty_bag_says_so(tmp_path: Path) -> None:
    BagRecorder(tmp_path / "bag", FLIGHT, TIMEBASE).close()
    assert "no messages on /joint_states (no topic of it has any)" in _error(tmp_path / "bag")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read anything")
def test_a_file_that_may_not_be_read_is_told(bag: Path) -> None:
    mcap_file(bag).chmod(0)
    assert "cannot be read (Permission denied)" in _error(bag)


def test_a_broken_db3_is_told_in_a_line(tmp_path: Path) -> None:
    (tmp_path / "x.db3").write_bytes(b"SQLite format 3\0" + bytes(4000))
    assert "cannot be read" in _error(tmp_path / "x.db3")
    with sqlite3.connect(tmp_path / "y.db3") as database:
        database.execute("CREATE TABLE notes(id INTEGER)")
    assert "cannot be read" in _error(tmp_path / "y.db3")


@pytest.mark.parametrize(
    ("change", "told"),
    [
        ("UPDATE topics SET name = x'00ff' WHERE name = '/clock'", "messages that are none"),
        ("UPDATE messages SET data = 999999999999 WHERE id = 5", "1 messages that are none"),
        ("UPDATE messages SET timestamp = 'noon' WHERE id = 7", "cannot be read to its end"),
        ("UPDATE topics SET type = 'a\nb' WHERE name = '/clock'", "left out: of type a?b"),
    ],
)
def test_anything_in_any_place_of_a_db3_is_left_out(
    recorded: Recorded, tmp_path: Path, change: str, told: str
) -> None:
    """Found by breaking databases by chance."""
    bag = rosbags_bag(tmp_path / "sqlite", entries_of(recorded.folder), lambda writer: None)
    (file,) = bag.glob("*.db3")
    with sqlite3.connect(file) as database:
        database.execute(change)
    log = read_flight(file)
    assert told in " ".join(log.damage)
    assert_rows_are_the_originals(log, recorded.log)


def _write(path: Path, entries: list[tuple[str, str, str, bytes]]) -> None:
    """An MCAP file: topic, type, encoding, message."""
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start("ros2")
        for stamp, (topic, kind, encoding, data) in enumerate(entries):
            schema = writer.register_schema(kind, "ros2msg", b"") if kind else 0
            channel = writer.register_channel(topic, encoding, schema)
            writer.add_message(channel, stamp, data, stamp)
        writer.finish()


@pytest.mark.parametrize("topic", ["/joint_states", "/reference/base"])
def test_another_type_on_our_topic_is_named(recorded: Recorded, tmp_path: Path, topic: str) -> None:
    entries = [(t.full_name, t.type, "cdr", data) for t, data in messages_of(recorded.folder)]
    wrong = [(n, "std_msgs/msg/String" if n == topic else k, e, d) for n, k, e, d in entries]
    _write(tmp_path / "x.mcap", wrong)
    line = _error(tmp_path / "x.mcap")
    assert f"{topic} is of type std_msgs/msg/String, {topics.BY_NAME[topic].type} is needed" in line
    as_json = [(n, k, "json" if n == topic else e, d) for n, k, e, d in entries]
    _write(tmp_path / "x.mcap", as_json)
    assert f"{topic} is encoded as 'json', 'cdr' is needed" in _error(tmp_path / "x.mcap")
    _write(tmp_path / "x.mcap", [entry for entry in entries if entry[0] != topic])
    assert f"no messages on {topic} (it has " in _error(tmp_path / "x.mcap")


def test_a_topic_not_needed_is_left_out_if_it_is_of_another_type(
    recorded: Recorded, tmp_path: Path
) -> None:
    entries = [(t.full_name, t.type, "cdr", data) for t, data in messages_of(recorded.folder)]
    changed = [
        (n, "geometry_msgs/msg/Twist" if n == "/command" else k, e, d) for n, k, e, d in entries
    ]
    _write(tmp_path / "x.mcap", changed)
    log = read_flight(tmp_path / "x.mcap")
    assert log.commanded_torque is None
    assert log.damage == (
        "/command is left out: of type geometry_msgs/msg/Twist, sensor_msgs/msg/JointState is "
        "needed",
    )
    unknown = [(n, "", e, d) for n, _, e, d in entries]  # no definitions at all
    _write(tmp_path / "x.mcap", unknown)
    log = read_flight(tmp_path / "x.mcap")
    assert log.whole.all()
    assert log.damage == ()
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(log, name), getattr(recorded.log, name))


# What does not end, and what is too much


@pytest.mark.parametrize("name", ["bag_0.mcap", "metadata.yaml", "x.mcap", "x.db3"])
@pytest.mark.parametrize("kind", ["pipe", "device", "socket"])
def test_only_files_are_read(bag: Path, tmp_path: Path, name: str, kind: str) -> None:
    """A pipe without a writer, or /dev/zero, was waited for or read for ever."""
    (path := bag / name).unlink(missing_ok=True)
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    else:
        with socket.socket(socket.AF_UNIX) as server:
            directory = os.open(bag, os.O_RDONLY)  # the path itself may be too long for a socket
            server.bind(f"/proc/self/fd/{directory}/{name}")
            os.close(directory)
    if name == METADATA:
        assert "metadata.yaml: " in read_flight(bag).damage[0]
    elif name == "bag_0.mcap":
        assert "not a file" in _error(bag)
    else:  # beside the bag's own file
        assert f"does not name {name}: left out" in read_flight(bag).damage[0]
    if name != METADATA:
        assert "not a file" in _error(path)


def test_an_unknown_version_is_told(bag: Path) -> None:
    _edit(bag, version=99)
    (told,) = read_flight(bag).damage
    assert told == "metadata.yaml: version 99, known are 1 to 9: read as one of those"


def test_aliases_that_unfold_without_measure_are_refused_at_once(bag: Path) -> None:
    """Once nine seconds, and more with each level."""
    content = yaml.safe_load((bag / METADATA).read_text())
    del content["rosbag2_bagfile_information"]["custom_data"]
    lines = ["  custom_data:", "    a0: &a0 [lol]"]
    for level in range(1, 9):
        lines.append(f"    a{level}: &a{level} [{', '.join([f'*a{level - 1}'] * 9)}]")
    (bag / METADATA).write_text(yaml.safe_dump(content) + "\n".join(lines) + "\n")
    log = read_flight(bag)
    assert METADATA in log.damage[0]
    assert len(log.damage[0]) < 300
    assert log.ticks == 400


def _with_topics(path: Path, count: int) -> Path:
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start("ros2")
        schema = writer.register_schema("std_msgs/msg/String", "ros2msg", b"")
        for k in range(count):
            channel = writer.register_channel(f"/topic_{k:05}", "cdr", schema)
            writer.add_message(channel, k, b"\0\1\0\0\1\0\0\0\0", k)
        writer.finish()
    return path


def test_of_ten_thousand_topics_a_few_are_named(tmp_path: Path) -> None:
    line = _error(_with_topics(tmp_path / "x.mcap", 10_000))
    assert "/topic_00000, /topic_00001, " in line
    assert line.endswith(", and 9,988 more)")
    assert len(line) < 400
    line = _error(tmp_path / "x.mcap", remap={"/a": "/command"})
    assert "no topic /a to remap" in line
    assert len(line) < 400


def test_counts_of_ten_thousand_topics_are_told_in_a_few_sentences(bag: Path) -> None:
    entries = yaml.safe_load((bag / METADATA).read_text())["rosbag2_bagfile_information"]
    counts = entries["topics_with_message_count"]
    topic = {"type": "std_msgs/msg/String", "serialization_format": "cdr"}
    for k in range(1000):
        counts.append({"topic_metadata": {"name": f"/t{k}", **topic}, "message_count": 1})
    _edit(bag, topics_with_message_count=counts)
    damage = read_flight(bag).damage
    assert len(damage) < 20
    assert any("so it is with 988 more topics" in text for text in damage)


def test_the_topic_that_is_there_but_empty_is_not_said_to_be_missing(tmp_path: Path) -> None:
    """Once "no messages on /joint_states (it has ..., /joint_states, ...)"."""
    recorder = BagRecorder(tmp_path / "bag", FLIGHT, TIMEBASE)
    recorder.record(topics.CLOCK, ClockCodec().encode(0))
    recorder.close()
    line = _error(tmp_path / "bag")
    assert "no messages on /joint_states (it has /clock)" in line


def test_a_topic_of_the_type_that_is_missing_is_named_first(
    recorded: Recorded, tmp_path: Path
) -> None:
    entries = [
        (t.full_name.replace("/joint_states", "/zz/arm"), t.type, "cdr", data)
        for t, data in messages_of(recorded.folder)
    ]
    _write(tmp_path / "x.mcap", entries)
    text = _error(tmp_path / "x.mcap")
    assert "no messages on /joint_states (it has /command, /controller/signals, /zz/arm, " in text
