"""The description of a topic's messages: one, for all who write and read them.

A topic's description stands in the module that is named after it (`description`). It says what
our own message is made of, and where in a decoded one, ours or another's, the numbers of a sample
stand. All else follows from the message's definition: the codecs and the bag reader read every
message that is laid out like one they have seen by copying its numbers.
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
    """The place of some of a sample's numbers: in a `State`, and in the rows of a flight log."""

    name: str
    first: int
    """The first of them among the numbers of that field."""
    length: int


class Run(NamedTuple):
    """Some of a sample's numbers, in its order, by their places in a slot of the message."""

    path: str
    order: Sequence[int]


def body(message: Bytes) -> Array:
    """All that may be float64 in a message's bytes; a view."""
    behind = message[BODY:]
    return behind[: len(behind) // 8 * 8].view(np.float64)


class Numbers(NamedTuple):
    """The places of a sample's numbers in all messages of a layout."""

    layout: MessageLayout
    offsets: Offsets
    """(K,) bytes from the message's beginning."""

    @property
    def words(self) -> NDArray[np.intp]:
        """(K,) places in `body`."""
        return ((self.offsets - np.uint64(BODY)) // np.uint64(8)).astype(np.intp)

    @property
    def values(self) -> Array:
        """(K,) numbers of the message that was laid out."""
        return body(self.layout.pattern[0])[self.words]


class MessageDescription(ABC):
    """The messages of one topic, and what their numbers mean."""

    topic: ClassVar[Topic]
    columns: tuple[SampleColumn, ...] = ()
    """The columns of one row, in the order of its numbers; of several rows each is a tick."""

    def __init__(self, names: Sequence[str], timebase: Timebase) -> None:
        """Describe the messages of a robot.

        Args:
            names: of the joints or axes, in the order of the sample's numbers.
            timebase: of the stamps.
        """
        self.names, self.timebase = tuple(names), timebase

    @classmethod
    def of_robot(cls, names: RobotNames, timebase: Timebase) -> MessageDescription:
        """The messages of a robot with these names, of which most need those of the joints."""
        return cls(names.joints, timebase)

    @abstractmethod
    def content(self, rows: int) -> Mapping[str, Any]:
        """The fields of our own message of so many rows; its numbers, all zero, may be left out."""

    @abstractmethod
    def runs(self, message: Any) -> Iterable[Run]:
        """The numbers of a decoded message, row by row, in the order of the columns.

        Raises:
            MessageError: it does not fit.
        """

    def own(self, rows: int = 1) -> Numbers:
        """The layout of our own message."""
        return self.learn(MessageLayout(self.topic.type, self.content(rows)).data)

    def learn(self, data: bytes) -> Numbers:
        """The layout of any message of the topic.

        Raises:
            MessageError: it does not fit, or is none.
        """
        message = decode(data, self.topic.type)
        runs = list(self.runs(message))
        layout = MessageLayout(self.topic.type, message)
        places = [layout.slots[path].offset + 8 * i for path, order in runs for i in order]
        return Numbers(layout, np.array(places, np.uint64))


def name_order(names: Sequence[str], expected: Sequence[str], topic: str) -> list[int]:
    """Find where each expected name stands among the given ones.

    Raises:
        MessageError: other names than expected.
    """
    if sorted(names) != sorted(expected):
        raise MessageError(f"{topic}: names {list(names)}, expected {list(expected)}", "names")
    return [list(names).index(name) for name in expected]


def description(topic: Topic) -> type[MessageDescription] | None:
    """Find the description of a topic's messages in the module of this folder with its name.

    None of one whose messages are no columns of numbers.
    """
    module = import_module(f"{__package__}.{topic.name.replace('/', '_')}")
    for known in vars(module).values():
        if isinstance(known, type) and getattr(known, "topic", None) is topic:
            return cast(type[MessageDescription], known)
    return None
