"""What we write beside what the real ``ros2 bag record`` wrote of the same topics, field by field.

Both bags are taken apart into plain mappings and walked together. Every difference must be one
that is meant, and every one that is meant must be there.
"""

from __future__ import annotations

import itertools
import re
import zlib
from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

import pytest
import yaml
from mcap.records import (
    Channel,
    Chunk,
    ChunkIndex,
    Footer,
    Header,
    McapRecord,
    Message,
    MessageIndex,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap.writer import MCAP0_MAGIC
from paths import DATA

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.writer import DESCRIPTION

SAMPLE = DATA / "rosbag2_sample"
TOPICS = ("/joint_states", "/base/state", "/command", "/reference/joints")
"""Those in the sample; a flight has three more."""

OTHER_RECORDING = "another recording: other times, counts, sizes, names"
MEANT = {
    r".*/(message|chunk|channel|metadata|schema)_count": OTHER_RECORDING,
    r"statistics/channel_message_counts/.*": OTHER_RECORDING,
    r".*/nanoseconds(_since_epoch)?|.*/message_(start|end)_time": OTHER_RECORDING,
    r".*/(path|relative_file_paths/0)": OTHER_RECORDING,
    r"chunk index/.*(offset|length|size).*|summary/./group_(start|length)": OTHER_RECORDING,
    r"footer/summary_.*": OTHER_RECORDING,
    r".*/custom_data": "what was flown, and the count of what was lost",
    r".*/history|.*/depth": "our recorder knows them; DDS does not tell rosbag2",
    r"header/library": "who wrote it",
    r"own metadata records": "they stand before rosbag2's: what is flown, what was lost",
    r"chunk/compression|chunk index/compression": "LZ4 unless told otherwise: half the size",
    r"chunk/checksum": "we give one: a spoilt chunk is found",
    r"chunk/all definitions first": "rosbag2 has each before its first message",
    r"message/sequence": "the tick; rosbag2 writes 0",
    r"message/own publish time": "of a simulated flight there is one time only",
}
"""Path of a difference, and why it is meant."""


def _information(content: Any) -> dict[str, Any]:
    """What metadata.yaml or a metadata record says, topics by name."""
    counted = content["topics_with_message_count"]
    topics = {topic["topic_metadata"]["name"]: topic for topic in counted}
    return {**content, "topics_with_message_count": topics}


def _kinds(records: list[McapRecord]) -> list[str]:
    """Types of records in their order, repeated ones once."""
    names = [
        f"Metadata {record.name}" if isinstance(record, Metadata) else type(record).__name__
        for record in records
    ]
    return [name for name, _ in itertools.groupby(names)]


def _is_own(record: McapRecord) -> bool:
    return isinstance(record, Metadata) and record.name == DESCRIPTION


def _definitions(schema: Schema) -> dict[str, str]:
    """The definitions in a schema by type; rosbag2 puts them in no order of its own."""
    first, *others = schema.data.decode().split("\n" + "=" * 80 + "\n")
    return {"": first} | dict(part.removeprefix("MSG: ").split("\n", 1) for part in others)


def _mcap(file: Path) -> dict[str, Any]:
    with file.open("rb") as stream:
        records = list(StreamReader(stream, emit_chunks=True, validate_crcs=True).records)
    content = file.read_bytes()

    def all_of(kind: Any) -> list[Any]:
        return [record for record in records if isinstance(record, kind)]

    (header,), (footer,), (statistics,) = map(all_of, (Header, Footer, Statistics))
    schemas = {schema.id: schema for schema in all_of(Schema)}
    channels = {c.id: c for c in all_of(Channel)}
    first_chunk = all_of(Chunk)[0]
    inside = breakup_chunk(first_chunk, validate_crc=True)
    messages = [record for record in inside if isinstance(record, Message)]
    counts = statistics.channel_message_counts
    texts = [
        yaml.safe_load(record.metadata["serialized_metadata"])
        for record in all_of(Metadata)
        if record.name == "rosbag2"
    ]
    return {
        "header": asdict(header),
        "own metadata records": any(_is_own(record) for record in records),
        "order": _kinds([record for record in records if not _is_own(record)]),
        "rosbag2 at the beginning": _information(texts[0]),
        "rosbag2 at the end": _information(texts[-1]),
        "schemas": {
            schema.name: {"encoding": schema.encoding, "definitions": _definitions(schema)}
            for schema in schemas.values()
        },
        "schemas of one type": len(schemas) == len({schema.name for schema in schemas.values()}),
        "channels": {
            channel.topic: {
                "message_encoding": channel.message_encoding,
                "schema": schemas[channel.schema_id].name,
                "offered_qos_profiles": yaml.safe_load(channel.metadata["offered_qos_profiles"]),
                "topic_type_hash": channel.metadata["topic_type_hash"],
                "keys": sorted(channel.metadata),
            }
            for channel in channels.values()
        },
        "chunk": {
            "compression": first_chunk.compression,
            "checksum": first_chunk.uncompressed_crc != 0,
            "kinds": sorted({type(record).__name__ for record in inside}),
            "all definitions first": _kinds(inside) == ["Schema", "Channel", "Message"],
        },
        "message": {
            "sequence": any(message.sequence for message in messages),
            "own publish time": any(m.publish_time != m.log_time for m in messages),
        },
        "messages in the index of their chunk": all(
            sum(len(index.records) for index in indexes) == len(chunk_messages)
            for chunk_messages, indexes in _chunks_and_indexes(records)
        ),
        "statistics": {
            **asdict(statistics),
            "channel_message_counts": {channels[c].topic: n for c, n in counts.items()},
        },
        "chunk index": {
            **asdict(all_of(ChunkIndex)[0]),
            "message_index_offsets": {
                channels[c].topic: offset
                for c, offset in all_of(ChunkIndex)[0].message_index_offsets.items()
            },
        },
        "metadata index": [i.name for i in all_of(MetadataIndex) if i.name != DESCRIPTION],
        "summary": [asdict(offset) for offset in all_of(SummaryOffset)],
        "footer": asdict(footer),
        "checksum of the summary is right": footer.summary_crc
        == zlib.crc32(content[footer.summary_start : -len(MCAP0_MAGIC) - 4]),
    }


def _chunks_and_indexes(
    records: list[McapRecord],
) -> Iterator[tuple[list[Message], list[MessageIndex]]]:
    indexes: list[MessageIndex] = []
    for record in reversed(records):
        if isinstance(record, MessageIndex):
            indexes.append(record)
        elif isinstance(record, Chunk):
            inside = breakup_chunk(record)
            yield [message for message in inside if isinstance(message, Message)], indexes
            indexes = []


def _bag(folder: Path) -> dict[str, Any]:
    content = yaml.safe_load((folder / "metadata.yaml").read_text())
    assert list(content) == ["rosbag2_bagfile_information"]
    (file,) = folder.glob("*.mcap")
    return {"metadata.yaml": _information(content["rosbag2_bagfile_information"]), **_mcap(file)}


def _differences(ours: Any, theirs: Any, path: str = "") -> Iterator[str]:
    if isinstance(ours, dict) and isinstance(theirs, dict):
        by_topic = any(key in TOPICS for key in theirs)
        more = by_topic or path == "schemas"  # a flight has further topics and types
        keys = list(theirs) if more else [*theirs, *(ours.keys() - theirs.keys())]
        for key in keys:
            here = f"{path}/{key}".lstrip("/")
            if key in ours and key in theirs:
                yield from _differences(ours[key], theirs[key], here)
            else:
                yield here
    elif isinstance(ours, list) and isinstance(theirs, list):
        for number, pair in enumerate(itertools.zip_longest(ours, theirs)):
            yield from _differences(*pair, f"{path}/{number}")
    elif ours != theirs or type(ours) is not type(theirs):
        yield path


@pytest.fixture(scope="module")
def ours(tmp_path_factory: pytest.TempPathFactory) -> Path:
    bag = tmp_path_factory.mktemp("bags") / "ours"
    simulate(Flight(resolve(FlightPlan(duration=0.08))), bag)  # one chunk
    return bag


def test_every_difference_from_rosbag2_is_meant(ours: Path) -> None:
    pytest.importorskip("rclpy")  # without ROS the definitions have no comments
    found = set(_differences(_bag(ours), _bag(SAMPLE)))
    unmeant = {path for path in found if not any(re.fullmatch(p, path) for p in MEANT)}
    assert not unmeant
    unused = {p for p in MEANT if not any(re.fullmatch(p, path) for path in found)}
    assert not unused


def test_keys_of_yaml_come_in_rosbag2s_order(ours: Path) -> None:
    def keys(value: Any) -> list[Any]:
        if isinstance(value, dict):
            return [key for pair in value.items() for key in (pair[0], *keys(pair[1]))]
        return keys(value[0]) if isinstance(value, list) and value else []

    def information(bag: Path) -> dict[str, Any]:
        content = yaml.safe_load((bag / "metadata.yaml").read_text())
        found: dict[str, Any] = content["rosbag2_bagfile_information"]
        return {**found, "custom_data": None}

    assert keys(information(ours)) == keys(information(SAMPLE))
