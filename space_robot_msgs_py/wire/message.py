"""Descriptions of a topic's messages, used by all writers and readers.

The description of a topic is in the module with its name (`description`). It defines the content of
our messages, and where the numbers of a sample are in any decoded message. The rest follows from
the message's definition: codecs and bag reader read messages with a known layout by copying their
numbers.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from importlib import import_module
from typing import Any, ClassVar, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ..errors import MessageError
from ..samples import RobotNames, Timebase
from ..topics import Topic
from .cdr import BODY, Bytes, MessageLayout
from .definitions import decode

Array = NDArray[np.float64]
Offsets = NDArray[np.uint64]


class SampleColumn(NamedTuple):
    """Position of some of a sample's numbers in a `State` and in the rows of a flight log."""

    name: str
    first: int
    """Index of the first one in the field."""
    length: int


class Run(NamedTuple):
    """Some of a sample's numbers, in order, by their indices in a slot of the message."""

    path: str
    order: Sequence[int]


def body(message: Bytes) -> Array:
    """Return a message's bytes after its header as an array of float64; a view."""
    behind = message[BODY:]
    return behind[: len(behind) // 8 * 8].view(np.float64)


class Numbers(NamedTuple):
    """Positions of a sample's numbers in all messages of a layout."""

    layout: MessageLayout
    offsets: Offsets
    """(K,) offsets from the start of the message, bytes."""

    @property
    def words(self) -> NDArray[np.intp]:
        """(K,) indices into `body`."""
        return ((self.offsets - np.uint64(BODY)) // np.uint64(8)).astype(np.intp)

    @property
    def values(self) -> Array:
        """(K,) numbers of the message that defined the layout."""
        return body(self.layout.pattern[0])[self.words]


class MessageDescription(ABC):
    """Description of the messages of a topic, and of their numbers."""

    topic: ClassVar[Topic]
    columns: tuple[SampleColumn, ...] = ()
    """Columns of a row, in the order of its numbers; each row of a message is a tick."""

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """Describe the messages of a robot.

        Args:
            names: of the joints or axes, in the order of the sample's numbers.
            timebase: conversion between ticks and stamps.
        """
        self.names, self.timebase = tuple(names), timebase

    @classmethod
    def of_robot(cls, names: RobotNames, timebase: Timebase) -> MessageDescription:
        """Describe the messages of a robot; by default with the names of its joints."""
        return cls(names.joints, timebase)

    @abstractmethod
    def content(self, rows: int) -> Mapping[str, Any]:
        """Return the fields of our message with ``rows`` rows; its numbers may be omitted."""

    @abstractmethod
    def runs(self, message: Any) -> Iterable[Run]:
        """Yield the numbers of a decoded message, row by row, in the order of the columns.

        Raises:
            MessageError: the message does not fit this robot.
        """

    def own(self, rows: int = 1) -> Numbers:
        """Return the layout of our message."""
        return self.learn(MessageLayout(self.topic.type, self.content(rows)).data)

    def learn(self, data: bytes) -> Numbers:
        """Return the layout of any message of the topic.

        Raises:
            MessageError: the bytes are not a message of this topic and robot.
        """
        message = decode(data, self.topic.type)
        runs = list(self.runs(message))
        layout = MessageLayout(self.topic.type, message)
        places = [layout.slots[path].offset + 8 * i for path, order in runs for i in order]
        return Numbers(layout, np.array(places, np.uint64))


def name_order(names: Sequence[str], expected: Sequence[str], topic: str) -> list[int]:
    """Return the index of each expected name in ``names``.

    Raises:
        MessageError: the names are not the expected ones.
    """
    if sorted(names) != sorted(expected):
        raise MessageError(f"{topic}: names {list(names)}, expected {list(expected)}", "names")
    return [list(names).index(name) for name in expected]


def description(topic: Topic) -> type[MessageDescription] | None:
    """Return the description of a topic's messages, from the module with its name.

    None for a topic without columns of numbers.
    """
    module = import_module(f"{__package__}.{topic.name.replace('/', '_')}")
    for known in vars(module).values():
        if isinstance(known, type) and getattr(known, "topic", None) is topic:
            return cast(type[MessageDescription], known)
    return None
