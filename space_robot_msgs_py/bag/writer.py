"""A rosbag2 bag of one or more MCAP files, as Jazzy's ``ros2 bag record`` writes them.

Each file stands for itself: the last message of every latched topic is at its beginning again.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from ..errors import InputError
from ..topics import Topic
from ..wire.definitions import definition, jazzy
from .mcap_file import Channel, Compression, McapFile
from .rosbag2_yaml import FileSummary, bag_information, qos_profiles, to_yaml

DESCRIPTION = "space_robot"
"""Name of our metadata records: one at each file's beginning, one at the bag's end."""


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
        self._topics = tuple(topics)
        self._description = dict(description)
        self._compression, self._split_size = compression, split_size
        self._channels = {topic.name: number for number, topic in enumerate(self._topics, 1)}
        self._in_files = [_channel(topic) for topic in self._topics]
        self._files: list[McapFile] = []
        self._latched: dict[int, tuple[int, int, bytes] | None] = {
            self._channels[topic.name]: None for topic in self._topics if topic.is_latched
        }
        """Publish time, sequence and bytes of the last message of each latched topic."""
        self._begins_file = False
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

    def write(self, topic: Topic, log_ns: int, publish_ns: int, sequence: int, data: bytes) -> int:
        """Add a message; the first after a full file begins another one.

        Returns:
            Bytes in the open chunk.

        Raises:
            OSError: the next file cannot be begun.
        """
        channel, sequence = self._channels[topic.name], sequence & 0xFFFFFFFF
        if self._begins_file:
            self._begins_file = False
            self._end_file({})
            self._begin_file()
            for latched, message in self._latched.items():
                if message:
                    self._files[-1].add(latched, log_ns, *message)
        file = self._files[-1]
        file.add(channel, log_ns, publish_ns, sequence, data)
        if channel in self._latched:
            self._latched[channel] = (publish_ns, sequence, data)
        return file.open_bytes

    def describe(self, description: Mapping[str, str]) -> None:
        """Note more, or what is known better, in this file, those to come and at the end.

        Raises:
            OSError: that failed.
        """
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
        if file.open_bytes:
            file.end_chunk()
            self._whole_bytes = file.size
            self._begins_file = 0 < self._split_size <= file.size

    def close(self, custom: Mapping[str, str]) -> None:
        """Finish the last file and write metadata.yaml, after a `flush`.

        Args:
            custom: what goes, with the description, into the bag's custom data.

        Raises:
            OSError: that failed.
        """
        self._end_file(custom)
        information = self._information({**self._description, **custom}, self._topics)
        text = to_yaml({"rosbag2_bagfile_information": information}) + "\n"
        part = self.path / "metadata.yaml.part"
        part.write_text(text, encoding="utf-8")
        part.replace(self.path / "metadata.yaml")

    def abandon(self) -> None:
        """After a failure: leave the whole chunks and, if there is room, a valid MCAP end."""
        self._files[-1].abandon(self._whole_bytes)

    def _begin_file(self) -> None:
        path = self.path / f"{self.path.name}_{len(self._files)}.mcap"
        file = McapFile(path, self._in_files, self._compression)
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
        file = self._files[-1]
        file.add_metadata(DESCRIPTION, custom)
        # rosbag2 has the bag's metadata at both ends of a file, too; `reindex` reads them
        text = to_yaml(self._information(custom, topics))
        file.add_metadata("rosbag2", {"serialized_metadata": text})

    def _information(self, custom: Mapping[str, str], topics: Sequence[Topic]) -> dict[str, object]:
        counts = sum((file.counts for file in self._files), Counter[int]())
        files = [FileSummary(f.path.name, f.span_ns, f.counts.total()) for f in self._files]
        counted = [(topic, counts[self._channels[topic.name]]) for topic in topics]
        return bag_information(files, counted, custom)


def _channel(topic: Topic) -> Channel:
    metadata = {
        "offered_qos_profiles": to_yaml(qos_profiles(topic)),
        "topic_type_hash": jazzy().hash_rihs01(topic.type),
    }
    return Channel(topic.full_name, topic.type, definition(topic.type).encode(), metadata)
