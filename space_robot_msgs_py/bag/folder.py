"""The messages of a bag's folder: of a finished bag through its index, else from the front."""

from __future__ import annotations

import os
import struct
from collections import Counter
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Protocol

from mcap.exceptions import McapError
from mcap.records import Channel, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import MCAP0_MAGIC
from rosbags.rosbag2 import Reader

from ..errors import InputError
from ..topics import Topic
from ..validation import read_yaml
from .writer import DESCRIPTION

METADATA = "metadata.yaml"
BROKEN = (McapError, struct.error, ValueError, RuntimeError, OverflowError, MemoryError)
"""What mcap's reader and lz4 raise on bytes that end early or make no sense."""


class Bag(Protocol):
    """What a flight is read from."""

    finished: bool

    def counts(self) -> dict[str, int]:
        """Messages a topic."""

    def custom_data(self) -> dict[str, str]:
        """What our recorder noted; empty for a bag of another recorder."""

    def messages(self, *wanted: Topic) -> Iterator[tuple[str, bytes]]:
        """Topic name and bytes of the messages of some topics, each topic's in its order."""


def open_bag(path: Path) -> Bag:
    """The bag in a folder, finished or not.

    Raises:
        InputError: no bag is there.
    """
    files = sorted(path.glob("*.mcap"), key=lambda file: (len(file.name), file.name))
    has_metadata = (path / METADATA).is_file()
    if not has_metadata and not files:
        hint = f"not a bag folder (no {METADATA}, no .mcap)" if path.exists() else "no such bag"
        raise InputError(f"{path}: {hint}")
    if has_metadata and all(map(_has_end, files)):
        return FinishedBag(path)
    return UnfinishedBag(files)


def custom_data(path: Path) -> dict[str, str]:
    """The ``custom_data`` of a finished bag's metadata.

    Raises:
        InputError: there is no metadata, or it is no rosbag2 metadata.
    """
    try:
        information = read_yaml(path / METADATA)["rosbag2_bagfile_information"]
        return information["custom_data"] or {}
    except (KeyError, TypeError):
        raise InputError(f"{path / METADATA}: not the metadata of a rosbag2 bag") from None


class FinishedBag:
    """Read with rosbags: ours, or one of ``ros2 bag record``."""

    finished = True

    def __init__(self, path: Path) -> None:
        self._path = path

    def counts(self) -> dict[str, int]:
        """Messages a topic."""
        with Reader(self._path) as reader:
            return {c.topic: c.msgcount for c in reader.connections}

    def custom_data(self) -> dict[str, str]:
        """What our recorder noted in metadata.yaml."""
        return custom_data(self._path)

    def messages(self, *wanted: Topic) -> Iterator[tuple[str, bytes]]:
        """Topic name and bytes, by log time."""
        names = {topic.name for topic in wanted}
        with Reader(self._path) as reader:
            connections = [c for c in reader.connections if c.topic in names]
            for connection, _, raw in reader.messages(connections):
                yield connection.topic, bytes(raw)


class UnfinishedBag:
    """Read from the front to the first record that is not whole."""

    finished = False

    def __init__(self, files: list[Path]) -> None:
        self._files = files

    def counts(self) -> dict[str, int]:
        """Messages a topic."""
        return Counter(name for name, _ in self._all())

    def custom_data(self) -> dict[str, str]:
        """What our recorder noted when it began."""
        for file in self._files:
            for record in _records(file):
                if isinstance(record, Metadata) and record.name == DESCRIPTION:
                    return record.metadata
                if isinstance(record, Message):
                    break
        return {}

    def messages(self, *wanted: Topic) -> Iterator[tuple[str, bytes]]:
        """Topic name and bytes, as they were written."""
        names = {topic.name for topic in wanted}
        return ((name, data) for name, data in self._all() if name in names)

    def _all(self) -> Iterator[tuple[str, bytes]]:
        for file in self._files:
            names: dict[int, str] = {}
            for record in _records(file):
                if isinstance(record, Message):
                    yield names[record.channel_id], record.data
                elif isinstance(record, Channel):
                    names[record.id] = record.topic


def _records(file: Path) -> Iterator[McapRecord]:
    with file.open("rb") as stream, suppress(*BROKEN):
        yield from StreamReader(stream, validate_crcs=True).records


def _has_end(file: Path) -> bool:
    size = len(MCAP0_MAGIC)
    if file.stat().st_size <= size:
        return False
    with file.open("rb") as stream:
        stream.seek(-size, os.SEEK_END)
        return stream.read() == MCAP0_MAGIC
