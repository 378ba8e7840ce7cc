"""Messages of a bag, in batches, for all storage formats, and the metadata.yaml of rosbag2."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, Protocol

from pydantic import BaseModel, Field, ValidationError

from ..config.validation import read_yaml, validate
from ..config.yaml_text import parse_yaml
from ..errors import InputError
from ..topics import Topic
from .batch import Batch
from .writer import DESCRIPTION, METADATA


class _Topic(BaseModel):
    name: str


class _Count(BaseModel):
    topic_metadata: _Topic
    message_count: int


class BagInformation(BaseModel):
    """Metadata of rosbag2 about a bag, of any version, as needed by a reader."""

    relative_file_paths: list[str] = Field(default_factory=list)
    topics_with_message_count: list[_Count]
    compression_mode: str = ""
    custom_data: dict[str, Any] | None = None

    @property
    def noted(self) -> dict[str, str]:
        """Custom data, as texts."""
        return {key: str(value) for key, value in (self.custom_data or {}).items()}

    @property
    def counts(self) -> dict[str, int]:
        """Number of messages per topic."""
        return {t.topic_metadata.name: t.message_count for t in self.topics_with_message_count}

    @property
    def compressed(self) -> bool:
        """True if rosbag2 itself compressed files or messages, rather than MCAP its chunks."""
        return self.compression_mode.lower() in ("file", "message")


def read_information(path: Path) -> BagInformation:
    """Read the metadata in a bag's folder.

    Raises:
        InputError: there is none, or it is no rosbag2 metadata.
    """
    file = path / METADATA
    content = read_yaml(file).get("rosbag2_bagfile_information")
    if not isinstance(content, dict):
        raise InputError(f"{file}: not the metadata of a rosbag2 bag")
    return validate(BagInformation, content, str(file))


def _information_in(file: Storage) -> BagInformation | None:
    """Return the copy of the metadata in an MCAP file; None if there is none."""
    try:
        text = file.metadata.get("rosbag2", {}).get("serialized_metadata", "")
        return BagInformation.model_validate(parse_yaml(text))
    except (InputError, ValidationError):
        return None


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
        self._files, self._damage = files, damage
        self.finished = closed and all(file.has_end for file in files)
        """True if its recorder closed it."""
        self._information, self._lacks_files = information, lacks_files

    def topics(self) -> dict[str, str]:
        """Return the type by topic."""
        return {name: kind for file in self._files for name, kind in file.topics().items()}

    def batches(self) -> Iterator[Batch]:
        """Yield all messages, as they were written, file by file."""
        for file in self._files:
            yield from file.batches()

    def recorded(self) -> dict[str, int] | None:
        """Return the number of messages per topic that the bag should hold; None: unknown.

        By the files' own statistics; by metadata.yaml, if they have none.
        """
        if self._lacks_files or any(file.counts is None for file in self._files):
            return self._information.counts if self._information else None
        return dict(sum((file.counts or Counter() for file in self._files), Counter[str]()))

    def custom_data(self) -> dict[str, str]:
        """Return the custom data of this project's recorder; empty for other recorders.

        From metadata.yaml, its copy in the file, or what was noted when recording began.
        """
        for information in (self._information, *map(_information_in, self._files[::-1])):
            if information and information.custom_data:
                return information.noted
        return next((m for f in self._files if (m := f.metadata.get(DESCRIPTION))), {})

    @property
    def incomplete(self) -> bool:
        """True if a part of a file was skipped, or a file is missing."""
        return self._lacks_files or any(file.incomplete for file in self._files)

    @property
    def damage(self) -> list[str]:
        """What is wrong with the folder and its files, a sentence each."""
        return self._damage + [text for file in self._files for text in file.damage]

    def counts(self) -> dict[str, int]:
        """Count the messages of each topic that can be read."""
        counts: Counter[str] = Counter()
        for batch in self.batches():
            counts[batch.topic] += len(batch)
        return counts

    def messages(self, *wanted: Topic) -> Iterator[tuple[str, bytes]]:
        """Yield topic name and bytes of messages of some topics, in order for each topic."""
        names = {topic.full_name for topic in wanted}
        for batch in self.batches():
            if batch.topic in names:
                yield from ((batch.topic, batch.message(i)) for i in range(len(batch)))


def some_of(names: Sequence[str]) -> str:
    """Return the first of some names, and how many there are more; a bag may have thousands."""
    shown = 12
    more = f", and {len(names) - shown:,} more" if len(names) > shown else ""
    return ", ".join(names[:shown]) + more
