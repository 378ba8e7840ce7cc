"""Messages of a bag, in batches, for all storage formats."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Protocol

from ..topics import Topic
from .batch import Batch
from .findings import SHOWN
from .metadata import METADATA, BagInformation, parse_information
from .writer import DESCRIPTION


class Storage(Protocol):
    """A file with messages, or a whole folder that rosbag2 compressed."""

    counts: Counter[str] | None
    """Messages per topic, from the file itself; None: not recorded."""
    metadata: dict[str, dict[str, str]]
    """The metadata records in it, by name."""
    has_end: bool
    """True if its writer closed it, as far as it is known."""

    def topics(self) -> dict[str, str]:
        """Return the type by topic."""

    def batches(self) -> Iterator[Batch]:
        """Yield all messages."""

    @property
    def incomplete(self) -> bool:
        """True if something could not be read; known after `batches`."""

    @property
    def damage(self) -> list[str]:
        """Damage, one sentence each; complete after `batches`."""


class Bag:
    """Files of a bag, with the metadata of rosbag2."""

    def __init__(
        self,
        files: Sequence[Storage],
        information: BagInformation | None,
        damage: list[str],
        closed: bool,
        lacks_files: bool = False,
    ) -> None:
        """Build from the contents of a folder.

        Args:
            files: in the order of their writing.
            information: metadata.yaml's (None: there is none that can be read).
            damage: what is wrong with the folder, a sentence each.
            closed: nothing but the files can say that the bag is unfinished.
            lacks_files: some that metadata.yaml names are not there.
        """
        self._files, self._found = files, damage
        self.finished = closed and all(file.has_end for file in files)
        """True if its recorder closed it."""
        self._information, self._lacks_files = information, lacks_files
        self._counts: Counter[str] = Counter()
        self._span_ns: tuple[int, int] | None = None

    def topics(self) -> dict[str, str]:
        """Return the type by topic."""
        return {name: kind for file in self._files for name, kind in file.topics().items()}

    def batches(self) -> Iterator[Batch]:
        """Yield all messages, as they were written, file by file."""
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
        """Return the number of messages per topic that the bag should hold; None: unknown.

        By the files' own statistics; by metadata.yaml, if they have none.
        """
        information = self._information
        if self._lacks_files or any(file.counts is None for file in self._files):
            return information.counts if information else None
        return dict(sum((file.counts or Counter() for file in self._files), Counter[str]()))

    def custom_data(self) -> dict[str, str]:
        """Return the custom data of this project's recorder; empty for other recorders.

        From metadata.yaml, its copy in the file, or what was noted when recording began.
        """
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
        """True if a part of a file was skipped, or a file is missing."""
        return self._lacks_files or any(file.incomplete for file in self._files)

    @property
    def damage(self) -> list[str]:
        """The faults of files and metadata.yaml, a sentence each."""
        texts = self._found + [text for file in self._files for text in file.damage]
        information, recorded = self._information, self.recorded()
        if not information or not recorded:
            return texts
        wrong = [
            f"{METADATA}: {count} messages on {name}, but {true} in the bag"
            for name, count in information.counts.items()
            if count != (true := max(recorded.get(name, 0), self._counts[name]))
        ]
        texts += wrong[:SHOWN]
        if len(wrong) > SHOWN:
            texts.append(f"{METADATA}: so it is with {len(wrong) - SHOWN:,} more topics")
        if self._counts == recorded and self._span_ns and information.span_ns != self._span_ns:
            claimed, true_span = (
                f"{start / 1e9:.9g} to {stop / 1e9:.9g} s"
                for start, stop in (information.span_ns, self._span_ns)
            )
            texts.append(f"{METADATA}: messages from {claimed}, but {true_span} in the bag")
        return texts

    def counts(self) -> dict[str, int]:
        """Count the messages of each topic that can be read."""
        for _ in self.batches():
            pass
        return self._counts

    def messages(self, *wanted: Topic) -> Iterator[tuple[str, bytes]]:
        """Yield topic name and bytes of messages of some topics, in order for each topic."""
        names = {topic.full_name for topic in wanted}
        for batch in self.batches():
            if batch.topic in names:
                yield from ((batch.topic, batch.message(i)) for i in range(len(batch)))
