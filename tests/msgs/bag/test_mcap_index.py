"""Every offset in a bag's file leads to the record it is said to lead to.

Readers of mcap follow some of them only, so the file is walked byte by byte here.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from mcap.opcode import Opcode
from mcap.stream_reader import StreamReader

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.samples import Timebase

MAGIC = 8
HEAD = struct.Struct("<BQ")


def walk(data: bytes) -> Iterator[tuple[int, int, int]]:
    """Offset, opcode and length of each record, its head included."""
    offset = MAGIC
    while offset < len(data) - MAGIC:
        opcode, length = HEAD.unpack_from(data, offset)
        yield offset, opcode, HEAD.size + length
        offset += HEAD.size + length
    assert offset == len(data) - MAGIC


def records(file: Path, name: str) -> list[Any]:
    """The records of one class, as mcap reads them."""
    with file.open("rb") as stream:
        found = StreamReader(stream, emit_chunks=True, validate_crcs=True).records
        return [record for record in found if type(record).__name__ == name]


@pytest.fixture(scope="module", params=["a flight", "nothing"])
def file(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    bag = tmp_path_factory.mktemp("bag") / "bag"
    if request.param == "nothing":
        BagRecorder(bag, {"period": 0.0005}, Timebase(500_000)).close()
    else:
        simulate(Flight(resolve(FlightPlan(duration=0.6))), bag)
    return bag / "bag_0.mcap"


def test_the_footer_leads_to_the_summary_and_to_its_offsets(file: Path) -> None:
    places = list(walk(file.read_bytes()))
    (footer,) = records(file, "Footer")
    (end,) = [offset + length for offset, opcode, length in places if opcode == Opcode.DATA_END]
    assert footer.summary_start == end
    first = next(offset for offset, opcode, _ in places if opcode == Opcode.SUMMARY_OFFSET)
    assert footer.summary_offset_start == first


def test_the_summary_offsets_cover_the_summary_group_by_group(file: Path) -> None:
    places = list(walk(file.read_bytes()))
    (footer,) = records(file, "Footer")
    summary = [p for p in places if footer.summary_start <= p[0] < footer.summary_offset_start]
    covered = []
    for group in records(file, "SummaryOffset"):
        begin, end = group.group_start, group.group_start + group.group_length
        members = [place for place in summary if begin <= place[0] < end]
        assert members[0][0] == begin
        assert members[-1][0] + members[-1][2] == end
        assert {opcode for _, opcode, _ in members} == {group.group_opcode}
        covered += members
    assert covered == summary


def test_chunk_indexes_lead_to_their_chunks_and_message_indexes(file: Path) -> None:
    places = {offset: (opcode, length) for offset, opcode, length in walk(file.read_bytes())}
    chunks = records(file, "Chunk")
    indexes = records(file, "ChunkIndex")
    assert len(indexes) == len(chunks) == sum(o == Opcode.CHUNK for o, _ in places.values())
    for index, chunk in zip(indexes, chunks, strict=True):
        assert places[index.chunk_start_offset] == (Opcode.CHUNK, index.chunk_length)
        assert index.compressed_size == len(chunk.data)
        assert index.uncompressed_size == chunk.uncompressed_size
        assert index.compression == chunk.compression
        assert index.message_start_time == chunk.message_start_time
        assert index.message_end_time == chunk.message_end_time
        behind = index.chunk_start_offset + index.chunk_length
        assert min(index.message_index_offsets.values()) == behind
        total = 0
        for offset in index.message_index_offsets.values():
            opcode, length = places[offset]
            assert opcode == Opcode.MESSAGE_INDEX
            total += length
        assert total == index.message_index_length
        after = behind + total
        assert places[after][0] != Opcode.MESSAGE_INDEX, "all of them are counted"


def test_metadata_indexes_lead_to_their_records(file: Path) -> None:
    places = {offset: (opcode, length) for offset, opcode, length in walk(file.read_bytes())}
    metadata = records(file, "Metadata")
    indexes = records(file, "MetadataIndex")
    assert [index.name for index in indexes] == [record.name for record in metadata]
    for index in indexes:
        assert places[index.offset] == (Opcode.METADATA, index.length)
    assert len(indexes) == sum(opcode == Opcode.METADATA for opcode, _ in places.values())
    (statistics,) = records(file, "Statistics")
    assert statistics.metadata_count == len(metadata)
    assert statistics.chunk_count == len(records(file, "Chunk"))
