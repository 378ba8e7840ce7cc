"""Bags broken by chance: what is read is what was recorded, and nothing else goes wrong.

``BAG_FUZZ_EXAMPLES=20000 pytest tests/msgs/test_bag_fuzz.py`` looks further, each time elsewhere.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from bags import (
    Recorded,
    assert_nothing_is_hidden,
    assert_rows_are_the_originals,
    entries_of,
    mcap_of,
    record,
    rosbags_bag,
)
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.writer import CompressionType

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import InputError

EXAMPLES = os.environ.get("BAG_FUZZ_EXAMPLES")
Change = tuple[str, str, float, float, int, bytes]
"""File, kind, two places, a number, some bytes.

A place below 1 is a share of the file's length, one above is near the beginning of a record.
"""

_FLIGHT_KEYS = (b'"period"', b'"case"', b"0.0005", b"tde_stc")


def _flip(content: bytearray, a: int, b: int, number: int, some: bytes) -> None:
    content[a] ^= 1 << number % 8


def _put(content: bytearray, a: int, b: int, number: int, some: bytes) -> None:
    content[a : a + len(some)] = some


def _insert(content: bytearray, a: int, b: int, number: int, some: bytes) -> None:
    content[a:a] = some


def _cut(content: bytearray, a: int, b: int, number: int, some: bytes) -> None:
    del content[a : a + number]


def _end(content: bytearray, a: int, b: int, number: int, some: bytes) -> None:
    del content[a:]


def _swap(content: bytearray, a: int, b: int, number: int, some: bytes) -> None:
    one, other = bytes(content[a : a + number]), bytes(content[b : b + number])
    content[b : b + number] = one
    content[a : a + number] = other


def _repeat(content: bytearray, a: int, b: int, number: int, some: bytes) -> None:
    content[b:b] = content[a : a + number]


def _zero(content: bytearray, a: int, b: int, number: int, some: bytes) -> None:
    content[a : a + number] = bytes(len(content[a : a + number]))


KINDS: dict[str, Callable[[bytearray, int, int, int, bytes], None]] = {
    "flip": _flip,
    "put": _put,
    "insert": _insert,
    "cut": _cut,
    "end": _end,
    "swap": _swap,
    "repeat": _repeat,
    "zero": _zero,
}

places = st.floats(0.0, 1.0, exclude_max=True) | st.floats(1.0, 200.0)
changes = st.tuples(
    st.sampled_from(["mcap", "mcap", "mcap", "yaml"]),
    st.sampled_from(sorted(KINDS)),
    places,
    places,
    st.one_of(st.integers(1, 40), st.integers(1, 20_000)),
    st.one_of(st.binary(min_size=1, max_size=12), st.sampled_from([*_FLIGHT_KEYS, b"\xff" * 8])),
)


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    return record(tmp_path_factory.mktemp("whole") / "bag", ticks=60, ticks_a_chunk=20)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("broken")


def record_starts(content: bytearray) -> list[int]:
    """Of a whole file; of a broken one as far as it is whole."""
    starts, at = [], 8
    while at + 9 < len(content):
        starts.append(at)
        at += 9 + int.from_bytes(content[at + 1 : at + 9], "little")
    return starts or [0]


def line_starts(content: bytearray) -> list[int]:
    return [0, *(i + 1 for i, byte in enumerate(content[:-1]) if byte == ord("\n"))]


def offset(place: float, starts: list[int], size: int) -> int:
    if place < 1.0:
        return int(place * size)
    return min(starts[int(place) % len(starts)] + int(place % 1.0 * 64), size - 1)


def broken(contents: dict[str, bytes], given_changes: list[Change]) -> dict[str, bytes]:
    """The files after all changes."""
    changed = {name: bytearray(content) for name, content in contents.items()}
    for name, kind, one, other, number, some in given_changes:
        if content := changed.get(name):
            starts = record_starts(content) if name == "mcap" else line_starts(content)
            at, to = (offset(place, starts, len(content)) for place in (one, other))
            KINDS[kind](content, at, to, number, some)
    return {name: bytes(content) for name, content in changed.items()}


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


def check(recorded: Recorded, folder: Path, given_changes: list[Change]) -> None:
    metadata = folder / "metadata.yaml"
    contents = {
        "mcap": recorded.file.read_bytes(),
        "yaml": (recorded.folder / metadata.name).read_bytes(),
    }
    contents = broken(contents, given_changes)
    (folder / recorded.file.name).write_bytes(contents["mcap"])
    metadata.write_bytes(contents["yaml"])
    if log := read_or_refused(folder):
        assert_rows_are_the_originals(log, recorded.log)
        assert_nothing_is_hidden(log, recorded.log)


fuzzed = settings(
    max_examples=int(EXAMPLES or 150),
    derandomize=not EXAMPLES,
    deadline=None,
    suppress_health_check=list(HealthCheck),
)


@fuzzed
@given(st.lists(changes, min_size=1, max_size=4))
def test_a_bag_broken_by_chance_is_read_truly_or_refused(
    recorded: Recorded, folder: Path, given_changes: list[Change]
) -> None:
    check(recorded, folder, given_changes)


@pytest.fixture(scope="module", params=["no CRC", "no chunks", "db3"])
def unguarded(
    request: pytest.FixtureRequest, recorded: Recorded, tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """A bag in which no checksum tells that a number has changed."""
    folder, entries = tmp_path_factory.mktemp("unguarded"), entries_of(recorded.folder)
    if request.param == "db3":
        return next(rosbags_bag(folder / "sqlite", entries, lambda writer: None).glob("*.db3"))
    options = {"enable_crcs": False, "use_chunking": request.param == "no CRC"}
    return mcap_of(folder / "x.mcap", entries, compression=CompressionType.NONE, **options)


@fuzzed
@given(st.lists(changes, min_size=1, max_size=4))
def test_a_bag_without_checksums_broken_by_chance_is_read_or_refused(
    unguarded: Path, folder: Path, given_changes: list[Change]
) -> None:
    file = folder / unguarded.name
    file.write_bytes(broken({"mcap": unguarded.read_bytes()}, given_changes)["mcap"])
    if log := read_or_refused(file):
        assert 0 < log.ticks < 100_000
