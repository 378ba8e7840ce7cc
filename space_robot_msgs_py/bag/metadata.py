"""The metadata.yaml of a rosbag2 bag, of any version."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel, Field, ValidationError

from ..config.validation import read_yaml, validate
from ..config.yaml_text import parse_yaml
from ..errors import InputError

METADATA = "metadata.yaml"
NEWEST = 9
"""Version of the format that is known, that of ROS 2 Jazzy; older ones have fewer keys."""


class _Nanoseconds(BaseModel):
    nanoseconds: int


class _Time(BaseModel):
    nanoseconds_since_epoch: int


class _Topic(BaseModel):
    name: str
    type: str


class _Count(BaseModel):
    topic_metadata: _Topic
    message_count: int


class BagInformation(BaseModel):
    """Metadata of rosbag2 about a bag, as needed by a reader."""

    version: int
    storage_identifier: str = ""
    relative_file_paths: list[str] = Field(default_factory=list)
    duration: _Nanoseconds
    starting_time: _Time
    message_count: int
    topics_with_message_count: list[_Count]
    compression_mode: str = ""
    custom_data: dict[str, Any] | None = None

    @property
    def doubts(self) -> list[str]:
        """Possible misinterpretations of the metadata, one sentence each."""
        if 1 <= self.version <= NEWEST:
            return []
        return [
            f"{METADATA}: version {self.version}, known are 1 to {NEWEST}: read as one of those"
        ]

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

    @property
    def span_ns(self) -> tuple[int, int]:
        """Log times of the first and the last message."""
        start = self.starting_time.nanoseconds_since_epoch
        return start, start + self.duration.nanoseconds


def read_information(path: Path) -> BagInformation:
    """Read the metadata in a bag's folder.

    Raises:
        InputError: there is none, or it is no rosbag2 metadata.
    """
    file = path / METADATA
    return _check(read_yaml(file).get("rosbag2_bagfile_information"), str(file))


def parse_information(text: str) -> BagInformation | None:
    """The same from the metadata record in an MCAP file; None if it is none."""
    try:
        return BagInformation.model_validate(parse_yaml(text))
    except (InputError, ValidationError):
        return None


def _check(content: Any, where: str) -> BagInformation:
    if not isinstance(content, dict):
        raise InputError(f"{where}: not the metadata of a rosbag2 bag")
    return validate(BagInformation, content, where)
