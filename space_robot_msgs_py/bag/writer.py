"""A rosbag2 bag of one or more MCAP files, as Jazzy's ``ros2 bag record`` writes them.

Each file stands for itself: the last message of every latched topic is at its beginning again.
"""

from __future__ import annotations

import errno
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, Literal, cast

import yaml
from mcap.writer import CompressionType, IndexType, Writer

from ..errors import InputError
from ..topics import Topic
from ..wire.definitions import definition, jazzy

Compression = Literal["none", "lz4", "zstd"]
DESCRIPTION = "space_robot"
"""Name of our metadata records: one at each file's beginning, one at the bag's end."""
METADATA = "metadata.yaml"
_INDEXES = IndexType.CHUNK | IndexType.MESSAGE | IndexType.METADATA
_NEVER_FULL = 1 << 62
"""Size of a chunk: only `BagWriter.flush` ends one."""
_MESSAGE_BYTES = 31
"""Length of a message's record without its data."""
_NEVER_NS = 2**63 - 1
"""Start of a bag without a message, as rosbag2 has it."""


class BagWriter:
    """Writes serialized messages; `flush` ends a chunk, `close` makes the bag whole."""

    def __init__(
        self,
        path: Path,
        topics: Iterable[Topic],
        description: Mapping[str, str],
        compression: Compression = "lz4",
        split_size: int = 0,
    ) -> None:
        """Create the bag's folder, unless it is there and empty, and its first file.

        Args:
            path: the folder.
            topics: all that will be written.
            description: stands at every file's beginning.
            compression: of the chunks.
            split_size: bytes from which on the next chunk goes into a file of its own (0: never).

        Raises:
            InputError: it exists already, or cannot be written.
        """
        self.path = path
        self.open_bytes = 0
        """Bytes of the messages in the open chunk."""
        self._topics = tuple(topics)
        self._description = dict(description)
        self._compression, self._split_size = compression, split_size
        self._channels = {topic.name: number for number, topic in enumerate(self._topics, 1)}
        self._files: list[_McapFile] = []
        self._latched: dict[int, tuple[int, int, bytes] | None] = {
            self._channels[topic.name]: None for topic in self._topics if topic.is_latched
        }
        """Publish time, sequence and bytes of the last message of each latched topic."""
        self._is_full = False
        """True if the next message is the first of another file."""
        try:
            path.mkdir(parents=True, exist_ok=True)
            if any(path.iterdir()):
                raise FileExistsError
            self._begin_file()
        except FileExistsError:
            raise InputError(f"{path}: exists already; a bag is never overwritten") from None
        except OSError as error:
            raise InputError(f"{path}: no bag can be written there ({error.strerror})") from None

    def write(self, topic: Topic, log_ns: int, publish_ns: int, sequence: int, data: bytes) -> None:
        """Add a message to the open chunk; the first after a full file begins another one."""
        channel, sequence = self._channels[topic.name], sequence & 0xFFFFFFFF
        if self._is_full:
            self._is_full = False
            self._end_file({})
            self._begin_file()
            for latched, message in self._latched.items():
                if message:
                    self._files[-1].add(latched, log_ns, *message)
        self._files[-1].add(channel, log_ns, publish_ns, sequence, data)
        self.open_bytes += _MESSAGE_BYTES + len(data)
        if channel in self._latched:
            self._latched[channel] = (publish_ns, sequence, data)

    def describe(self, description: Mapping[str, str]) -> None:
        """Note more, or what is known better, in this file, those to come and at the end."""
        self._description |= description
        self._add_records(self._description, ())
        self._whole_bytes = self._files[-1].size

    def flush(self) -> None:
        """End the open chunk and hand it to the kernel.

        Raises:
            OSError: that failed; `abandon` leaves the whole chunks of before.
            FileNotFoundError: the file is no longer at its path.
        """
        file = self._files[-1]
        file.check_in_place()
        if self.open_bytes:
            file.writer.flush()
            self.open_bytes = 0
            self._whole_bytes = file.size
            self._is_full = 0 < self._split_size <= file.size

    def close(self, custom: Mapping[str, str]) -> None:
        """Finish the last file and write metadata.yaml with more custom data, after a `flush`."""
        self._end_file(custom)
        information = self._information({**self._description, **custom}, self._topics)
        text = _to_yaml({"rosbag2_bagfile_information": information})
        # a bag that has the file is finished, so it must appear whole
        part = self.path / f"{METADATA}.part"
        part.write_text(text, encoding="utf-8")
        part.replace(self.path / METADATA)

    def abandon(self) -> None:
        """Leave the whole chunks, after a failure."""
        self._files[-1].abandon(self._whole_bytes)

    def _begin_file(self) -> None:
        path = self.path / f"{self.path.name}_{len(self._files)}.mcap"
        file = _McapFile(path, self._topics, self._compression)
        self._files.append(file)
        try:
            self._add_records(self._description, ())  # no topics yet, as rosbag2 has it
        except OSError:
            self._files.pop().remove()
            raise
        self._whole_bytes = file.size

    def _end_file(self, custom: Mapping[str, str]) -> None:
        self._add_records({**self._description, **custom}, self._topics)
        self._files[-1].finish()

    def _add_records(self, custom: Mapping[str, str], topics: Sequence[Topic]) -> None:
        writer = self._files[-1].writer
        writer.add_metadata(DESCRIPTION, dict(custom))
        # rosbag2 has the bag's metadata at both ends of a file, too; `reindex` reads them
        text = _to_yaml(self._information(custom, topics))
        writer.add_metadata("rosbag2", {"serialized_metadata": text})

    def _information(self, custom: Mapping[str, str], topics: Sequence[Topic]) -> dict[str, object]:
        """Return what metadata.yaml says (version 9, Jazzy's), in the order of rosbag2's keys."""
        counts = sum((file.counts for file in self._files), Counter[int]())
        start, duration = _times(self._files)
        return {
            "version": 9,
            "storage_identifier": "mcap",
            "duration": duration,
            "starting_time": start,
            "message_count": counts.total(),
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": topic.full_name,
                        "type": topic.type,
                        "serialization_format": "cdr",
                        "offered_qos_profiles": _qos_profiles(topic),
                        "type_description_hash": jazzy().hash_rihs01(topic.type),
                    },
                    "message_count": counts[self._channels[topic.name]],
                }
                for topic in topics
            ],
            # of whole files or messages, which rosbag2 does beside MCAP; chunks say it themselves
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [file.path.name for file in self._files],
            "files": [
                {
                    "path": file.path.name,
                    **dict(zip(("starting_time", "duration"), _times([file]), strict=True)),
                    "message_count": file.counts.total(),
                }
                for file in self._files
            ],
            "custom_data": dict(custom) or None,
            "ros_distro": "jazzy",
        }


def _times(files: Sequence[_McapFile]) -> tuple[dict[str, int], dict[str, int]]:
    spans_ns = [file.span_ns for file in files if file.span_ns]
    first = min((first for first, _ in spans_ns), default=_NEVER_NS)
    last = max((last for _, last in spans_ns), default=_NEVER_NS)
    return {"nanoseconds_since_epoch": first}, {"nanoseconds": last - first}


def _qos_profiles(topic: Topic) -> list[dict[str, Any]]:
    forever = {"sec": 9223372036, "nsec": 854775807}
    return [
        {
            "history": "keep_last",
            "depth": topic.depth,
            "reliability": "reliable",
            "durability": "transient_local" if topic.transient_local else "volatile",
            "deadline": {**forever},
            "lifespan": {**forever},
            "liveliness": "automatic",
            "liveliness_lease_duration": {**forever},
            "avoid_ros_namespace_conventions": False,
        }
    ]


def _to_yaml(value: Any) -> str:
    # PyYAML's own code looks at each letter of the long descriptions in Python
    dumper = getattr(yaml, "CSafeDumper", yaml.SafeDumper)
    text: str = yaml.dump(value, Dumper=dumper, sort_keys=False, width=2**31 - 1)
    return text


class _McapFile:
    """A file with an `mcap.Writer`, whose chunks end on request and are passed to the kernel."""

    def __init__(self, path: Path, topics: Sequence[Topic], compression: Compression) -> None:
        self.path = path
        self.size = 0
        """Bytes written."""
        self.counts: Counter[int] = Counter()
        """Number of messages by channel."""
        self.span_ns: tuple[int, int] | None = None
        """First and last log time (None: no message)."""
        # what is written is with the kernel, and survives this process
        self._file = path.open("xb", buffering=0)
        self.writer = Writer(
            cast(IO[Any], self),
            chunk_size=_NEVER_FULL,
            compression=CompressionType[compression.upper()],
            index_types=_INDEXES,
        )
        try:
            self.writer.start("ros2", "space_robot")
        except OSError:
            self.remove()
            raise
        schemas = {
            kind: self.writer.register_schema(kind, "ros2msg", definition(kind).encode())
            for kind in dict.fromkeys(topic.type for topic in topics)
        }
        for topic in topics:
            metadata = {
                "offered_qos_profiles": _to_yaml(_qos_profiles(topic)),
                "topic_type_hash": jazzy().hash_rihs01(topic.type),
            }
            self.writer.register_channel(topic.full_name, "cdr", schemas[topic.type], metadata)

    def add(self, channel: int, log_ns: int, publish_ns: int, sequence: int, data: bytes) -> None:
        """Add a message to the open chunk."""
        self.writer.add_message(channel, log_ns, data, publish_ns, sequence)
        self.counts[channel] += 1
        first, last = self.span_ns or (log_ns, log_ns)
        self.span_ns = min(first, log_ns), max(last, log_ns)

    def finish(self) -> None:
        """Write indexes and statistics, and close the file."""
        self.writer.finish()
        self._file.close()

    def abandon(self, size: int) -> None:
        """Keep the first ``size`` bytes, as a killed recorder leaves a file."""
        if not self._file.closed:
            with suppress(OSError):
                self._file.truncate(size)
            self._file.close()

    def remove(self) -> None:
        """Close and delete the file."""
        self._file.close()
        self.path.unlink(missing_ok=True)

    def check_in_place(self) -> None:
        """Check that the file was not removed or moved away."""
        with suppress(FileNotFoundError, NotADirectoryError):
            if os.path.samestat(self.path.stat(), os.fstat(self._file.fileno())):
                return
        raise FileNotFoundError(errno.ENOENT, "its file was removed or moved away")

    def write(self, data: bytes) -> None:
        """Write all bytes, or raise an error; called by `mcap.Writer`, as `tell` and `flush`."""
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]
        self.size += len(data)

    def tell(self) -> int:
        """Return the number of bytes written."""
        return self.size

    def flush(self) -> None:
        """Do nothing: the kernel has all bytes."""
