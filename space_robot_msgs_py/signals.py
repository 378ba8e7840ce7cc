"""Declaration of a measured, commanded or desired quantity; all else follows from it.

`space_robot_msgs_py.samples` has the table of all signals. From it follow the records of kernels,
the columns of a log, the content of messages, what is read from bags, and the reference of topics.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from enum import Enum
from typing import Any, NamedTuple

from .compiled.records import Field
from .topics import Topic


class Reporter(Enum):
    """Who reports a signal, and which robots have it."""

    SENSORS = "of base and joints, measured by sensors, which may spoil it"
    ECHO = "reported by the plant"
    PASSIVE = "of joints without motors; no controller reads it"
    ACTUATORS = "of actuators of the base and of motors behind gears"
    ORBIT = "of robots in an orbit"
    OTHERS = "of the desired motion and of the controller"


class Each(NamedTuple):
    """One number for each of something that a robot has by name."""

    names: str
    """Attribute of `RobotNames`."""
    room: Callable[[int], int]
    """Numbers in a record, for n joints with motors; those that a robot has not are 0."""


class MessageField(NamedTuple):
    """Field of a topic's messages that carries a signal, or some of its numbers."""

    topic: Topic
    path: str
    """Such as ``effort`` or ``twist[0].angular``; in trajectories relative to a point."""
    first: int
    """Index of the first of the signal's numbers."""
    length: int | None
    """How many there are; None: all that follow."""


@dataclass(frozen=True)
class Signal(Field):
    """Declaration of a signal: a field of a record, and what it is outside of it."""

    size: int | Each = 0
    text: str = ""
    unit: str = ""
    frame: str = ""
    reporter: Reporter = Reporter.OTHERS
    fields: tuple[MessageField, ...] = ()
    labels: tuple[str, ...] = ()
    """Name of each number, in messages that name their numbers."""
    column: str = ""
    """Column of a log that has it behind others; empty: the column of its own name."""

    def sent(
        self, topic: Topic, path: str, first: int = 0, length: int | None = None, column: str = ""
    ) -> Signal:
        """Return the declaration with a `MessageField` that carries it, and its `column`."""
        fields = (*self.fields, MessageField(topic, path, first, length))
        return replace(self, fields=fields, column=column or self.column)

    def named(self, *names: str) -> Signal:
        """Return the declaration with `labels`: of each name x, y, and z."""
        return replace(self, labels=tuple(f"{name}_{axis}" for name in names for axis in "xyz"))

    def width(self, names: Any) -> int:
        """Return how many numbers a robot with these `RobotNames` has in a message."""
        return self.size if isinstance(self.size, int) else len(getattr(names, self.size.names))


def signal(reporter: Reporter, size: int | Each, unit: str, frame: str, text: str) -> Any:
    """Declare a `Signal`.

    Args:
        reporter: who reports it.
        size: how many numbers it has.
        unit: of each; of joints that slide read m for rad, and N for N m.
        frame: whose axes it is on, or what it is relative to; empty: none.
        text: what it is.
    """
    room = size.room if isinstance(size, Each) else lambda n: size
    description = ", ".join(filter(None, (text, unit, frame)))
    return Signal(lambda n: (room(n),), description, False, size, text, unit, frame, reporter)


def signals_of(table: type) -> dict[str, Signal]:
    """Return the signals that a class declares, by name: those of its base classes first."""
    return {
        name: value
        for owner in reversed(table.__mro__)
        for name, value in vars(owner).items()
        if isinstance(value, Signal)
    }


def carried_by(topic: Topic, *tables: type) -> Iterator[tuple[str, Signal, MessageField]]:
    """Yield name, declaration and field of each signal in a topic's messages."""
    for table in tables:
        for name, declared in signals_of(table).items():
            for field in declared.fields:
                if field.topic.name == topic.name:
                    yield name, declared, field
