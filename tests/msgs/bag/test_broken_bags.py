"""Broken bags: what is readable is read as it was recorded, and the rest is told in a line."""

from __future__ import annotations

import os
import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

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
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import Writer as McapWriter

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.wire.telemetry import ClockCodec

METADATA = "metadata.yaml"
_CHUNK_CRC = 9 + 24
"""From a chunk's start: opcode, length, two times and a size stand before it."""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return record(tmp_path_factory.mktemp("whole") / "bag", compression="none")


@pytest.fixture
def bag(recorded: Recorded, tmp_path: Path) -> Path:
    return Path(shutil.copytree(recorded.folder, tmp_path / "bag"))


def _flip(at: Callable[[Path], int]) -> Callable[[Path], None]:
    """A bit of one byte of the bag's file."""

    def harm(bag: Path) -> None:
        content = bytearray(mcap_file(bag).read_bytes())
        content[at(bag)] ^= 0x10
        mcap_file(bag).write_bytes(content)

    return harm


def _second_chunk(bag: Path) -> int:
    start, length = chunks_of(bag)[1]
    return start + length // 2


def _in_a_chunk(harm: Callable[[bytearray, int], None]) -> Callable[[Path], None]:
    """The second chunk's records from a place on, where no checksum tells it."""

    def change(bag: Path) -> None:
        content, (start, _) = bytearray(mcap_file(bag).read_bytes()), chunks_of(bag)[1]
        crc = start + _CHUNK_CRC
        assert content[crc + 4 : crc + 8] == bytes(4), "compressed"
        content[crc : crc + 4] = bytes(4)
        harm(content, crc + 16)
        mcap_file(bag).write_bytes(content)

    return change


def _longer(content: bytearray, at: int) -> None:
    content[at + 1 : at + 9] = (1 << 40).to_bytes(8, "little")


def _no_message(content: bytearray, at: int) -> None:
    """A channel's opcode before what is a message."""
    content[at] = 4


def _edit(change: Callable[[dict[str, Any]], object]) -> Callable[[Path], None]:
    def harm(bag: Path) -> None:
        content = yaml.safe_load((bag / METADATA).read_text())
        change(content["rosbag2_bagfile_information"])
        (bag / METADATA).write_text(yaml.safe_dump(content))

    return harm


def _second_file(information: dict[str, Any]) -> None:
    information["relative_file_paths"].append("bag_1.mcap")
    for entry in information["topics_with_message_count"]:
        entry["message_count"] *= 2


DAMAGES: dict[str, tuple[Callable[[Path], object], list[str]]] = {
    "second chunk": (
        _flip(_second_chunk),
        ["bag_0.mcap: unreadable from byte ", "messages cannot be read", "/joint_states 300"],
    ),
    "longer message": (
        _in_a_chunk(_longer),
        ["bag_0.mcap: a chunk is unreadable (a message that is not whole"],
    ),
    "no message": (_in_a_chunk(_no_message), ["bag_0.mcap: a chunk is unreadable"]),
    "index": (_flip(lambda bag: -25), ["bag_0.mcap: its index cannot be read"]),
    "footer": (
        lambda bag: mcap_file(bag).write_bytes(mcap_file(bag).read_bytes()[:-40]),
        ["the bag was not finished"],
    ),
    "no text": (lambda bag: (bag / METADATA).write_bytes(b"\xff\xfe\x00"), [METADATA]),
    "odd key": (lambda bag: (bag / METADATA).write_bytes(b"? [a]\n: b"), [METADATA]),
    "deep": (lambda bag: (bag / METADATA).write_bytes(b"[" * 9000), [METADATA]),
    "another file": (
        lambda bag: shutil.copy(mcap_file(bag), bag / "other.mcap"),
        ["metadata.yaml does not name other.mcap: left out"],
    ),
    "renamed": (
        lambda bag: mcap_file(bag).rename(bag / "other.mcap"),
        ["names bag_0.mcap, not there"],
    ),
    "split": (_edit(_second_file), ["bag_1.mcap, not there", "/joint_states 400"]),
}
"""How each bag is broken, and what is told."""
LOST = {"second chunk": 300, "longer message": 300, "no message": 300, "split": 400}
"""Messages of a topic that are not read."""


@pytest.mark.parametrize("kind", DAMAGES)
def test_what_is_readable_is_read_and_the_rest_told(
    recorded: Recorded, bag: Path, kind: str
) -> None:
    harm, words = DAMAGES[kind]
    harm(bag)
    log = read_flight(bag)
    assert log.whole.all()
    lost = LOST.get(kind, 0)
    assert log.ticks == (100 if lost == 300 else 400)
    assert_rows_are_the_originals(log, recorded.log)
    told = [*log.damage, log.unfinished]
    assert bool(log.unfinished) == (kind == "footer")
    assert all(any(word in text for text in told) for word in words), told
    for topic in (topics.JOINT_STATES, topics.BASE_STATE, topics.COMMAND):
        assert log.lost[topic.full_name] == lost
    assert log.flight == FLIGHT


# Refused in one line


def _error(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_flight(path)
    line = str(caught.value)
    assert "\n" not in line
    assert len(line) < 500
    assert str(path) in line
    return line


def _file(name: str, content: bytes = b"") -> Callable[[Path], Path]:
    def make(folder: Path) -> Path:
        (folder / name).write_bytes(content)
        return folder / name

    return make


def _own(folder: Path) -> Path:
    recorder = BagRecorder(folder / "own", FLIGHT, TIMEBASE)
    recorder.record(topics.CLOCK, ClockCodec().encode(0))
    recorder.close()
    return folder / "own"


def _folder_for_file(folder: Path) -> Path:
    mcap_file(folder / "bag").unlink()
    (folder / "bag/bag_0.mcap").mkdir()
    return folder / "bag"


def _write(path: Path, entries: list[tuple[str, str, str, bytes]]) -> Path:
    """An MCAP file: topic (empty: not in the file), type, encoding, message."""
    with path.open("wb") as file:
        writer = McapWriter(file)
        writer.start("ros2")
        for stamp, (topic, kind, encoding, data) in enumerate(entries):
            schema = writer.register_schema(kind, "ros2msg", b"") if kind else 0
            channel = writer.register_channel(topic, encoding, schema) if topic else 9999
            writer.add_message(channel, stamp, data, stamp)
        writer.finish()
    return path


@pytest.mark.parametrize(
    ("make", "told"),
    [
        (lambda folder: folder / "nothing", "no such bag"),
        (lambda folder: folder, "not a bag folder"),
        (_file("notes.txt", b"no bag"), "neither .mcap nor .db3"),
        (_file("x.mcap"), "no messages on /joint_states"),
        (_file("x.db3", b"SQLite format 3\0" + bytes(4000)), "cannot be read"),
        (_folder_for_file, "cannot be read (Is a directory)"),
        (_own, "no messages on /joint_states (it has /clock)"),
    ],
)
def test_what_is_no_bag_is_told_in_a_line(
    bag: Path, tmp_path: Path, make: Callable[[Path], Path], told: str
) -> None:
    assert told in _error(make(tmp_path))


@pytest.fixture(scope="module")
def entries(recorded: Recorded) -> list[tuple[str, str, str, bytes]]:
    return [(t.full_name, t.type, "cdr", data) for t, data in messages_of(recorded.folder)]


@pytest.mark.parametrize(
    ("topic", "column", "content", "told"),
    [
        ("/joint_states", 1, "x/msg/A", "is of type x/msg/A, sensor_msgs/msg/JointState is needed"),
        ("/joint_states", 2, "json", "is encoded as 'json', 'cdr' is needed"),
        ("/joint_states", 0, "/zz/arm", "(it has /command, /controller/signals, /zz/arm, "),
        ("/reference/base", 1, "x/msg/A", "is of type x/msg/A, trajectory_msgs/msg/MultiDOFJoint"),
        ("/reference/base", 2, "json", "is encoded as 'json', 'cdr' is needed"),
        ("/reference/base", 0, "/other", "no messages on /reference/base (it has "),
    ],
)
def test_a_topic_that_is_needed_and_does_not_fit_is_named(
    entries: list[tuple[str, str, str, bytes]],
    tmp_path: Path,
    topic: str,
    column: int,
    content: str,
    told: str,
) -> None:
    """Of another type or encoding, or under another name: those of its type come first."""
    changed: Any = [
        (*e[:column], content, *e[column + 1 :]) if e[0] == topic else e for e in entries
    ]
    line = _error(_write(tmp_path / "x.mcap", changed))
    assert topic in line
    assert told in line


def test_a_topic_not_needed_is_left_out_if_it_is_of_another_type_or_unknown(
    recorded: Recorded, entries: list[tuple[str, str, str, bytes]], tmp_path: Path
) -> None:
    twist = [
        (n, "geometry_msgs/msg/Twist" if n == "/command" else k, e, d) for n, k, e, d in entries
    ]
    log = read_flight(_write(tmp_path / "x.mcap", twist))
    assert log.commanded_torque is None
    told = "/command is left out: of type geometry_msgs/msg/Twist, sensor_msgs/msg/JointState is "
    assert log.damage == (f"{told}needed",)
    log = read_flight(_write(tmp_path / "x.mcap", [(n, "", e, d) for n, _, e, d in entries]))
    assert log.damage == ()  # without definitions
    unknown = read_flight(_write(tmp_path / "x.mcap", [*entries, ("", "", "", b"?")]))
    assert unknown.damage == ("x.mcap: 1 messages of an unknown topic",)
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(log, name), getattr(recorded.log, name))


@pytest.mark.parametrize("name", ["bag_0.mcap", METADATA, "x.db3"])
@pytest.mark.parametrize("kind", ["pipe", "device"])
def test_only_files_are_read(bag: Path, name: str, kind: str) -> None:
    """Else a pipe without a writer, or /dev/zero, would be read for ever."""
    (path := bag / name).unlink(missing_ok=True)
    if kind == "pipe":
        os.mkfifo(path)
    else:
        path.symlink_to("/dev/zero")
    if name == "bag_0.mcap":
        assert "not a file" in _error(bag)
    else:
        told = "metadata.yaml: " if name == METADATA else f"does not name {name}: left out"
        assert told in read_flight(bag).damage[0]
    if name != METADATA:
        assert "not a file" in _error(path)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (
            "UPDATE messages SET data = 999 WHERE id = (SELECT max(id) FROM messages)",
            "cannot be read to its end",
        ),
        ("UPDATE messages SET timestamp = 'noon' WHERE id = 7", "cannot be read to its end"),
        ("UPDATE topics SET type = 'a\nb' WHERE name = '/clock'", "left out: of type a?b"),
    ],
)
def test_anything_in_any_place_of_a_db3_is_left_out(
    recorded: Recorded, tmp_path: Path, change: str, told: str
) -> None:
    bag = rosbags_bag(tmp_path / "sqlite", entries_of(recorded.folder), lambda writer: None)
    (file,) = bag.glob("*.db3")
    with sqlite3.connect(file) as database:
        database.execute(change)
    log = read_flight(file)
    assert told in " ".join(log.damage)
    assert_rows_are_the_originals(log, recorded.log)


# Broken by chance

Change = tuple[str, str, float, float, int, bytes]
"""File, kind, two places (shares of its length; above 1: near a record), a number, some bytes."""
KINDS: dict[str, Callable[[bytearray, int, int, int, bytes], bytes]] = {
    "flip": lambda c, a, b, n, some: c[:a] + bytes([c[a] ^ 1 << n % 8]) + c[a + 1 :],
    "put": lambda c, a, b, n, some: c[:a] + some + c[a + len(some) :],
    "insert": lambda c, a, b, n, some: c[:a] + some + c[a:],
    "cut": lambda c, a, b, n, some: c[:a] + c[a + n :],
    "end": lambda c, a, b, n, some: c[:a],
    "repeat": lambda c, a, b, n, some: c[:b] + c[a : a + n] + c[b:],
    "zero": lambda c, a, b, n, some: c[:a] + bytes(len(c[a : a + n])) + c[a + n :],
}
places = st.floats(0.0, 1.0, exclude_max=True) | st.floats(1.0, 200.0)
changes = st.tuples(
    st.sampled_from(["mcap", "mcap", "mcap", "yaml"]),
    st.sampled_from(sorted(KINDS)),
    places,
    places,
    st.one_of(st.integers(1, 40), st.integers(1, 20_000)),
    st.one_of(st.binary(min_size=1, max_size=12), st.sampled_from([b'"period"', b"0.0005"])),
)


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return record(tmp_path_factory.mktemp("short") / "bag", ticks=60, ticks_a_chunk=20)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("broken")


def broken(contents: dict[str, bytes], given_changes: list[Change]) -> dict[str, bytes]:
    """The files after all changes."""
    for name, kind, one, other, number, some in given_changes:
        if content := contents.get(name):
            starts, at = [0], 8
            while name == "mcap" and at + 9 < len(content):
                starts.append(at)
                at += 9 + int.from_bytes(content[at + 1 : at + 9], "little")
            a, b = (
                int(place * len(content))
                if place < 1.0
                else min(starts[int(place) % len(starts)] + int(place % 1 * 64), len(content) - 1)
                for place in (one, other)
            )
            contents[name] = bytes(KINDS[kind](bytearray(content), a, b, number, some))
    return contents


def read_or_refused(path: Path) -> FlightLog | None:
    """The flight; None if it was refused in one line."""
    try:
        log = read_flight(path)
    except InputError as error:
        assert str(error).isprintable()  # noqa: PT017
        return None
    assert all(count >= 0 for count in log.lost.values())
    assert all(text.isprintable() for text in (*log.damage, log.unfinished))
    return log


fuzzed = settings(max_examples=120, suppress_health_check=list(HealthCheck))


@fuzzed
@given(st.lists(changes, min_size=1, max_size=4))
def test_a_bag_broken_by_chance_is_read_truly_or_refused(
    short: Recorded, folder: Path, given_changes: list[Change]
) -> None:
    contents = {"mcap": short.file.read_bytes()}
    contents["yaml"] = (short.folder / METADATA).read_bytes()
    contents = broken(contents, given_changes)
    (folder / short.file.name).write_bytes(contents["mcap"])
    (folder / METADATA).write_bytes(contents["yaml"])
    if log := read_or_refused(folder):
        assert_rows_are_the_originals(log, short.log)
        is_whole = log.ticks == short.log.ticks and log.whole.all()
        assert is_whole or log.damage or log.unfinished, "what is missing is told"
