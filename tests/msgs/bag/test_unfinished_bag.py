"""Bags that nobody finished: killed recorders, full disks, folders that went away."""

from __future__ import annotations

import errno
import os
import resource
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from bags import (
    FLIGHT,
    TIMEBASE,
    Recorded,
    assert_rows_are_the_originals,
    chunks_of,
    mcap_file,
    messages_of,
    record,
)
from flights import simulated
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from space_robot.analysis import analyze
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag import recorder as recorder_module
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.errors import FlightError, InputError

CHUNK_MESSAGES = 70
Messages = list[tuple[topics.Topic, bytes]]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Recorded:
    """In four chunks of 100 ticks."""
    return record(tmp_path_factory.mktemp("recorded") / "bag")


@pytest.fixture(scope="module")
def messages(recorded: Recorded) -> Messages:
    """What the nodes send in 400 ticks."""
    return list(messages_of(recorded.folder))


def _record(recorder: BagRecorder, messages: Messages) -> None:
    for start in range(0, len(messages), CHUNK_MESSAGES):
        for topic, data in messages[start : start + CHUNK_MESSAGES]:
            recorder.record(topic, data)
        recorder.flush()


@contextmanager
def _file_size_limit(size: int) -> Iterator[None]:
    """No file of this process grows beyond ``size``: to a writer the same as a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@settings(max_examples=80, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_cut_anywhere_every_whole_chunk_is_read(
    recorded: Recorded, tmp_path: Path, data: st.DataObject
) -> None:
    """Also where zeros or noise follow, as after a power cut."""
    content = recorded.file.read_bytes()
    cut = data.draw(st.integers(0, len(content) - 1), label="cut")
    tail = data.draw(st.sampled_from([b"", bytes(500), b"\xff" * 500]), label="tail")
    shutil.rmtree(bag := tmp_path / "bag", ignore_errors=True)
    bag.mkdir()
    (bag / "bag_0.mcap").write_bytes(content[:cut] + tail)
    if data.draw(st.booleans(), label="with metadata.yaml"):
        shutil.copy(recorded.folder / "metadata.yaml", bag)
    last = 100 * sum(start + length <= cut for start, length in chunks_of(recorded.folder)) - 1
    try:
        log = read_flight(bag)
    except InputError as error:
        assert last == -1
        assert str(bag) in str(error)  # noqa: PT017
        return
    assert log.ticks - 1 == last or (tail and log.ticks - 1 > last)
    assert_rows_are_the_originals(log, recorded.log)
    assert log.flight == FLIGHT
    assert log.unfinished.endswith(f"read up to t = {(log.ticks - 1) * 0.0005:.4f} s")
    assert not any(log.lost.values())


def test_a_whole_file_without_metadata_is_read_to_its_end_and_the_report_says_so(
    recorded: Recorded, tmp_path: Path
) -> None:
    """The recorder was killed between the two."""
    shutil.copy(mcap_file(recorded.folder), tmp_path)
    log = read_flight(tmp_path)
    assert log.ticks == recorded.log.ticks
    assert analyze(log)["unfinished"] == "the bag was not finished: read up to t = 0.1995 s"
    assert analyze(recorded.log)["unfinished"] == recorded.log.unfinished == ""


def test_what_was_flushed_is_readable_while_the_recorder_runs(
    messages: Messages, tmp_path: Path
) -> None:
    """Nothing stays in the library's or in Python's buffers."""
    recorder = BagRecorder(tmp_path / "bag", FLIGHT, TIMEBASE)
    for number, (topic, data) in enumerate(messages, 1):
        recorder.record(topic, data)
        if number % 100 == 0:
            recorder.flush()
            assert sum(open_bag(tmp_path / "bag").counts().values()) == number
    assert read_flight(tmp_path / "bag").ticks == recorder.kept_tick + 1


def test_open_chunk_ends_when_it_is_old_though_nothing_comes(
    messages: Messages, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recorder_module, "CHUNK_AGE_S", 0.0)
    recorder = BagRecorder(tmp_path / "bag", FLIGHT, TIMEBASE)
    for topic, data in messages[:10]:
        recorder.record(topic, data)
    recorder.flush_if_due()
    assert sum(open_bag(tmp_path / "bag").counts().values()) == 10


@pytest.mark.parametrize("limit", [2_000, 40_000, 80_000])
def test_full_disk_keeps_what_fitted_and_stops_nobody(
    messages: Messages, tmp_path: Path, limit: int
) -> None:
    bag = tmp_path / "bag"
    with _file_size_limit(limit):
        recorder = BagRecorder(bag, FLIGHT, TIMEBASE)
        _record(recorder, messages)
        assert recorder.failure == os.strerror(errno.EFBIG)
        with pytest.raises(FlightError) as raised:
            recorder.close()
        recorder.close()
    assert f"messages not kept: {recorder.unkept}" in str(raised.value)
    assert str(bag) in str(raised.value)
    assert recorder.received == len(messages)
    assert sum(open_bag(bag).counts().values()) == len(messages) - recorder.unkept
    if recorder.kept_tick < 0:
        assert "last tick kept: none" in str(raised.value)
        with pytest.raises(InputError, match="not finished"):
            read_flight(bag)
    else:
        assert f"last tick kept: tick {recorder.kept_tick} " in str(raised.value)
        assert read_flight(bag).ticks == recorder.kept_tick + 1


def test_full_disk_at_the_beginning_and_under_a_simulated_flight(tmp_path: Path) -> None:
    with _file_size_limit(100), pytest.raises(InputError, match="File too large"):
        BagRecorder(tmp_path / "bag", FLIGHT, TIMEBASE)
    with _file_size_limit(50_000), pytest.raises(FlightError, match="last tick kept"):
        simulated(tmp_path / "other", duration=0.1)


def test_full_disk_at_the_end_loses_no_message(messages: Messages, tmp_path: Path) -> None:
    """No room for index and metadata: the messages are there all the same."""
    bag = tmp_path / "bag"
    recorder = BagRecorder(bag, FLIGHT, TIMEBASE)
    _record(recorder, messages)
    with _file_size_limit(mcap_file(bag).stat().st_size + 60), pytest.raises(FlightError):
        recorder.close()
    assert recorder.unkept == 0
    assert not (bag / "metadata.yaml").exists()
    assert read_flight(bag).ticks == 400


def test_removed_folder_is_noticed_and_nothing_written_in_its_place(
    messages: Messages, tmp_path: Path
) -> None:
    bag = tmp_path / "bag"
    recorder = BagRecorder(bag, FLIGHT, TIMEBASE)
    _record(recorder, messages[:200])
    shutil.rmtree(bag)
    bag.mkdir()
    (bag / "bag_0.mcap").touch()
    _record(recorder, messages[200:])
    assert "removed or moved" in recorder.failure
    assert recorder.unkept == len(messages)
    with pytest.raises(FlightError, match="last tick kept: none"):
        recorder.close()
    assert [file.name for file in bag.iterdir()] == ["bag_0.mcap"]
    assert (bag / "bag_0.mcap").stat().st_size == 0
