"""Bags to read and to break: small flights in several chunks, and what must hold of their logs."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from flights import simulated
from mcap.reader import make_reader
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin, Writer

from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import REFERENCE, FlightLog
from space_robot_msgs_py.bag.folder import open_bag, read_information
from space_robot_msgs_py.bag.message_accounting import noted_accounts
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import FLIGHT_KEY, BagRecorder
from space_robot_msgs_py.bag.writer import Compression
from space_robot_msgs_py.samples import STATE_FIELDS, Timebase
from space_robot_msgs_py.wire.definitions import definition, jazzy
from space_robot_msgs_py.wire.viewers import wrap

TIMEBASE = Timebase(500_000)
FLIGHT = {"controller": "tde_stc", "case": "1", "period": 0.0005}
COLUMNS = (*STATE_FIELDS, *REFERENCE, "commanded_torque")

Entry = tuple[str, str, int, bytes]
"""Topic, type, log time, message."""


@dataclass
class Recorded:
    """A finished bag of several chunks, and the flight in it."""

    folder: Path
    log: FlightLog

    @property
    def file(self) -> Path:
        return mcap_file(self.folder)


def assert_same_flight(log: FlightLog, original: FlightLog) -> None:
    assert log.damage == ()
    assert log.unfinished == ""
    assert log.joint_names == original.joint_names
    assert log.timebase == original.timebase
    assert not any(log.lost.values())
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(log, name), getattr(original, name), name)


def mcap_file(bag: Path) -> Path:
    return next(bag.glob("*.mcap"))


def messages_of(bag: Path) -> Iterator[tuple[topics.Topic, bytes]]:
    """The messages of one of our bags, by the mcap library."""
    with mcap_file(bag).open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages(log_time_order=False):
            yield as_sent(channel.topic, message.data)


def messages_in(bag: Path, *wanted: topics.Topic) -> Iterator[tuple[str, bytes]]:
    """Names and bytes of the messages of some topics (by default of all), as we read them."""
    names = {topic.full_name for topic in wanted or topics.ALL}
    for batch in open_bag(bag).batches():
        if batch.topic in names:
            yield from ((batch.topic, batch.message(i)) for i in range(len(batch)))


def as_sent(name: str, data: bytes) -> tuple[topics.Topic, bytes]:
    """A message of our bags as the recorder was given it, by its topic's name in the bag."""
    (topic,) = (topic for topic in topics.RECORDED if topic.recorded.full_name == name)
    return topic, wrap(data) if topic.carries else data


def chunks_of(bag: Path) -> list[tuple[int, int]]:
    """Where the chunks with messages lie: start and length in bytes."""
    with mcap_file(bag).open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    chunks = sorted(summary.chunk_indexes, key=lambda chunk: chunk.chunk_start_offset)
    return [(c.chunk_start_offset, c.chunk_length) for c in chunks if c.message_index_offsets]


def record(
    folder: Path, ticks: int = 400, ticks_a_chunk: int = 100, compression: Compression = "lz4"
) -> Recorded:
    """A flight in a bag whose chunks end at the same ticks as the reference's messages."""
    flown = folder.with_name(folder.name + "_flown")
    simulated(flown, duration=ticks * TIMEBASE.period)
    recorder, states = BagRecorder(folder, FLIGHT, TIMEBASE, compression), 0
    for topic, data in messages_of(flown):
        if topic is topics.REFERENCE_JOINTS and states and states % ticks_a_chunk == 0:
            recorder.flush()
        states += topic is topics.JOINT_STATES
        recorder.record(topic, data)
    recorder.close()
    return Recorded(folder, read_flight(folder))


def assert_rows_are_the_originals(log: FlightLog, original: FlightLog) -> None:
    """What can be read is as it was, and nothing came to it."""
    assert log.joint_names == original.joint_names
    assert log.timebase == original.timebase
    assert log.ticks <= original.ticks
    for name in COLUMNS:
        column, true = getattr(log, name), getattr(original, name)
        if column is None:
            assert name == "commanded_torque"
            continue
        there = np.isfinite(column)
        np.testing.assert_array_equal(column[there], true[: log.ticks][there], name)


def entries_of(bag: Path) -> list[Entry]:
    """Messages as a recorder on another machine would have them: by its own clock."""
    clock = 1_795_220_105_128_297_452
    sent = ((topic.recorded, data) for topic, data in messages_of(bag) if not topic.carries)
    return [(t.full_name, t.type, clock + 31_000 * i, data) for i, (t, data) in enumerate(sent)]


def within(namespace: str, entries: Sequence[Entry]) -> list[Entry]:
    """The same messages of a robot in a namespace."""
    return [(namespace + name, kind, stamp, data) for name, kind, stamp, data in entries]


def rosbags_bag(folder: Path, entries: Iterable[Entry], setup: Callable[[Writer], Any]) -> Path:
    storage = StoragePlugin.SQLITE3 if "sqlite" in folder.name else StoragePlugin.MCAP
    writer = Writer(folder, version=9, storage_plugin=storage)
    setup(writer)
    with writer:
        connections: dict[str, Any] = {}
        for name, kind, log_ns, data in entries:
            if name not in connections:
                connections[name] = writer.add_connection(name, kind, typestore=jazzy())
            writer.write(connections[name], log_ns, data)
    return folder


def mcap_of(path: Path, entries: Iterable[Entry], **options: Any) -> Path:
    with path.open("wb") as file:
        writer = McapWriter(file, **options)
        writer.start("ros2")
        channels: dict[str, int] = {}
        for name, kind, log_ns, data in entries:
            if name not in channels:
                schema = writer.register_schema(kind, "ros2msg", definition(kind).encode())
                channels[name] = writer.register_channel(name, "cdr", schema)
            writer.add_message(channels[name], log_ns, data, log_ns)
        writer.finish()
    return path


def read_accounts(bag: Path) -> dict[str, dict[str, Any]]:
    """What our recorder counted of each topic of a finished bag: received, missing, ..."""
    return {n: a.model_dump() for n, a in noted_accounts(read_information(bag).noted).items()}


def redescribed(bag: Path, description: str | None) -> Path:
    """The bag with another text as its flight's description, or with none; changed in place."""
    file = bag / "metadata.yaml"
    content = yaml.load(file.read_text("utf-8"), yaml.CSafeLoader)
    noted = content["rosbag2_bagfile_information"]["custom_data"]
    noted.pop(FLIGHT_KEY, None)
    if description is not None:
        noted[FLIGHT_KEY] = description
    noted["kept"] = "so that the copies in the MCAP file are not asked"
    file.write_text(yaml.dump(content, Dumper=yaml.CSafeDumper), "utf-8")
    return bag
