"""Bags that are not plain MCAP, read with rosbags, in the batches of plain MCAP."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..errors import InputError
from .batch import Batch

if TYPE_CHECKING:
    from rosbags.rosbag2 import Reader

_BATCH = 1000


class RosbagsStorage:
    """A db3 file, or the folder of a bag that rosbag2 compressed."""

    def __init__(self, path: Path) -> None:
        """Look at it.

        Raises:
            InputError: it cannot be read.
        """
        self._path = path
        self.counts: Counter[str] | None = None
        self.metadata: dict[str, dict[str, str]] = {}
        self.has_end = True
        self._fault = ""
        self._not_messages = 0
        try:
            with _reader(path) as reader:
                names = {c.topic: c.msgtype for c in reader.connections}
        except Exception as error:  # sqlite and zstd have errors of their own
            raise InputError(f"{path}: cannot be read ({_line(error)})") from None
        # a broken database may have anything in any place
        self._types = {name: kind for name, kind in names.items() if _is_text(name, kind)}

    def topics(self) -> dict[str, str]:
        """Type by topic."""
        return self._types

    @property
    def incomplete(self) -> bool:
        """True if the messages could not be read to their end."""
        return bool(self._fault)

    @property
    def damage(self) -> list[str]:
        """The sentence that says so."""
        return [self._fault] if self._fault else []

    def batches(self) -> Iterator[Batch]:
        """All messages by log time; they end where they can no longer be read."""
        self._fault, self._not_messages = "", 0
        waiting: dict[str, list[tuple[int, bytes]]] = {name: [] for name in self._types}
        try:
            with _reader(self._path) as reader:
                for connection, log_ns, data in reader.messages():
                    if connection.topic not in waiting or not isinstance(data, bytes):
                        self._not_messages += 1
                        continue
                    entries = waiting[connection.topic]
                    entries.append((int(log_ns), data))
                    if len(entries) == _BATCH:
                        yield self._batch(connection.topic, entries)
                        entries.clear()
        except Exception as error:  # likewise
            self._fault = f"{self._path.name}: cannot be read to its end ({_line(error)})"
        if self._not_messages and not self._fault:
            self._fault = f"{self._path.name}: {self._not_messages} messages that are none"
        for name, entries in waiting.items():
            if entries:
                yield self._batch(name, entries)

    def _batch(self, topic: str, entries: list[tuple[int, bytes]]) -> Batch:
        data = np.frombuffer(b"".join(message for _, message in entries), np.uint8)
        lengths = np.array([len(message) for _, message in entries], np.int64)
        log_ns = np.array([stamp % 2**63 for stamp, _ in entries], np.int64)
        starts = np.cumsum(lengths) - lengths
        return Batch(topic, self._types[topic], "cdr", data, starts, lengths, log_ns, log_ns)


def _reader(path: Path) -> Reader:
    from rosbags.rosbag2 import Reader  # few bags need it, with its YAML and SQLite

    return Reader(path)


def _is_text(*values: object) -> bool:
    return all(isinstance(value, str) for value in values)


def _line(error: Exception) -> str:
    return " ".join(str(error).split()) or type(error).__name__
