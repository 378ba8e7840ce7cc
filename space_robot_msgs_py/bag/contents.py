"""What a bag holds, in batches: MCAP read by ourselves, anything else by rosbags."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from ..topics import Topic
from .batch import Batch
from .findings import SHOWN
from .mcap_storage import McapStorage
from .metadata import METADATA, BagInformation, parse_information
from .rosbags_storage import RosbagsStorage
from .writer import DESCRIPTION


class Bag(ABC):
    """What a flight is read from."""

    finished: bool
    """Whether its recorder closed it."""

    @abstractmethod
    def topics(self) -> dict[str, str]:
        """Type by topic."""

    @abstractmethod
    def batches(self) -> Iterator[Batch]:
        """All messages, as they were written."""

    @abstractmethod
    def recorded(self) -> dict[str, int] | None:
        """Messages a topic that the bag should hold; None: nobody counted."""

    @abstractmethod
    def custom_data(self) -> dict[str, str]:
        """What our recorder noted; empty for a bag of another recorder."""

    @property
    @abstractmethod
    def incomplete(self) -> bool:
        """Whether something in it could not be read; known after `batches`."""

    @property
    @abstractmethod
    def damage(self) -> list[str]:
        """What is wrong with the bag, a sentence each; all of it is known after `batches`."""

    def counts(self) -> dict[str, int]:
        """Messages a topic that can be read."""
        counts: Counter[str] = Counter()
        for batch in self.batches():
            counts[batch.topic] += len(batch)
        return counts

    def messages(self, *wanted: Topic) -> Iterator[tuple[str, bytes]]:
        """Topic name and bytes of the messages of some topics, each topic's in its order."""
        names = {topic.name for topic in wanted}
        for batch in self.batches():
            if batch.topic in names:
                yield from ((batch.topic, batch.message(i)) for i in range(len(batch)))


class McapBag(Bag):
    """MCAP files, of any recorder."""

    def __init__(
        self, files: list[McapStorage], information: BagInformation | None, damage: list[str],
        closed: bool,
    ) -> None:  # fmt: skip
        """``closed``: nothing but the files can say that the bag is unfinished."""
        self._files, self._found = files, damage
        self.finished = closed and all(file.has_end for file in files)
        self._information = information
        named = len(information.relative_file_paths) if information else 0
        self._missing = len(files) < named
        self._counts: Counter[str] = Counter()
        self._span_ns: tuple[int, int] | None = None

    def topics(self) -> dict[str, str]:
        """Type by topic."""
        return {name: kind for file in self._files for name, kind in file.topics().items()}

    def batches(self) -> Iterator[Batch]:
        """All messages, as they were written, file by file."""
        self._counts, self._span_ns = Counter(), None
        for file in self._files:
            for batch in file.batches():
                self._counts[batch.topic] += len(batch)
                first, last = int(batch.log_ns.min()), int(batch.log_ns.max())
                if self._span_ns:
                    first, last = min(first, self._span_ns[0]), max(last, self._span_ns[1])
                self._span_ns = first, last
                yield batch

    def recorded(self) -> dict[str, int] | None:
        """By the files' own statistics; by metadata.yaml, if they have none."""
        information = self._information
        if self._missing or any(file.counts is None for file in self._files):
            return information.counts if information else None
        return dict(sum((file.counts or Counter() for file in self._files), Counter[str]()))

    def custom_data(self) -> dict[str, str]:
        """From metadata.yaml, its copy in the file, or what our recorder noted when it began."""
        copies = [
            parse_information(file.metadata.get("rosbag2", {}).get("serialized_metadata", ""))
            for file in self._files[::-1]
        ]
        for information in (self._information, *copies):
            if information and information.custom_data:
                return information.noted
        return next((m for f in self._files if (m := f.metadata.get(DESCRIPTION))), {})

    @property
    def incomplete(self) -> bool:
        """Whether a part of a file was passed over, or a file is missing."""
        return self._missing or any(file.incomplete for file in self._files)

    @property
    def damage(self) -> list[str]:
        """What is wrong with files and metadata.yaml."""
        found = self._found + [text for file in self._files for text in file.damage]
        information, recorded = self._information, self.recorded()
        if not information or not recorded:
            return found
        wrong = [
            f"{METADATA}: {count} messages on {name}, but {true} in the bag"
            for name, count in information.counts.items()
            if count != (true := max(recorded.get(name, 0), self._counts[name]))
        ]
        found += wrong[:SHOWN]
        if len(wrong) > SHOWN:
            found.append(f"{METADATA}: so it is with {len(wrong) - SHOWN:,} more topics")
        if self._counts == recorded and self._span_ns and information.span_ns != self._span_ns:
            claimed, true_span = (
                f"{start / 1e9:.9g} to {stop / 1e9:.9g} s"
                for start, stop in (information.span_ns, self._span_ns)
            )
            found.append(f"{METADATA}: messages from {claimed}, but {true_span} in the bag")
        return found


class StoredBag(Bag):
    """What rosbags reads: sqlite3, and files or messages that rosbag2 compressed."""

    def __init__(
        self, sources: list[Path], information: BagInformation | None, damage: list[str],
        closed: bool,
    ) -> None:  # fmt: skip
        self._sources = [RosbagsStorage(source) for source in sources]
        self._information, self._found, self.finished = information, damage, closed

    def topics(self) -> dict[str, str]:
        """Type by topic."""
        return {name: kind for source in self._sources for name, kind in source.topics().items()}

    def batches(self) -> Iterator[Batch]:
        """All messages by their time, file by file."""
        for source in self._sources:
            yield from source.batches()

    def recorded(self) -> dict[str, int] | None:
        """By metadata.yaml."""
        return self._information.counts if self._information else None

    def custom_data(self) -> dict[str, str]:
        """From metadata.yaml."""
        return self._information.noted if self._information else {}

    @property
    def incomplete(self) -> bool:
        """Whether a file could not be read to its end."""
        return any(source.fault for source in self._sources)

    @property
    def damage(self) -> list[str]:
        """What is wrong with files and metadata.yaml."""
        return self._found + [s.fault for s in self._sources if s.fault]
