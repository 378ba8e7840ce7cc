"""Content of a topic's messages, and where their numbers are, from the table of signals.

A few families of types carry all signals: rows of numbers by name (JointState), bodies
(MultiDOFJointState), both as points of a trajectory, and fields of any other message. What follows
is of them all: the content of our messages, and the numbers of a sample in any decoded message, in
any order of names. Messages that differ only in their numbers are then read by copying these.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..errors import MessageError
from ..samples import CommandSignals, Reference, RobotNames, State, TelemetrySignals, Timebase
from ..signals import carried_by, signals_of
from ..topics import Topic
from .cdr import BODY, STAMP, Bytes, MessageLayout, header_stamp_ns
from .definitions import decode

Array = NDArray[np.float64]
Offsets = NDArray[np.uint64]
XYZ, WXYZ = (0, 1, 2), (3, 0, 1, 2)
"""Indices of a sample's vector, and of its quaternion (w, x, y, z), in ROS's order (x, y, z, w)."""
ROWS = dict.fromkeys(
    ("position", "velocity", "positions", "velocities", "accelerations", "effort")
).keys()
"""Fields with a number for each name, in the order in which samples have them."""
TABLES = (State, Reference, CommandSignals, TelemetrySignals)
TELEMETRY_ROWS = tuple(signals_of(TelemetrySignals))


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


def body(message: Bytes) -> Array:
    """Return a message's bytes after its header as an array of float64; a view."""
    behind = message[BODY:]
    return behind[: len(behind) // 8 * 8].view(np.float64)


class MessageDescription:
    """Content of a topic's messages for a robot, and their numbers."""

    def __init__(self, topic: Topic, names: RobotNames | Sequence[str], timebase: Timebase) -> None:
        """Describe the messages.

        Args:
            topic: any but /controller/law.
            names: of the robot; or those of the rows of a topic that has rows by name.
            timebase: of stamps and of the points of a trajectory.
        """
        self.topic, self.timebase = topic, timebase
        self.names: tuple[str, ...] = ()
        self.fields: dict[str, list[SampleColumn]] = {}
        """Columns by the field that carries them."""
        behind: dict[str, int] = {}
        for name, declared, field in carried_by(topic, *TABLES):
            columns = self.fields.setdefault(field.path, [])
            if not isinstance(names, RobotNames):
                columns[:] = [SampleColumn(field.path, 0, len(names))]
                continue
            length = field.length or declared.width(names) - field.first
            first = behind.get(declared.column, 0) if declared.column else field.first
            behind[declared.column] = first + length
            columns.append(SampleColumn(declared.column or name, first, length))
            self.names += declared.labels
        if not isinstance(names, RobotNames):
            self.names = tuple(names)
        elif topic.of:
            self.names = getattr(names, topic.of)
        if self.fields.keys() <= ROWS:
            self.fields = {path: self.fields[path] for path in ROWS if path in self.fields}
        self.columns = tuple(column for columns in self.fields.values() for column in columns)
        """Columns of a row, in the order of its numbers; each row of a message is a tick."""
        self._is_trajectory = topic.type.startswith("trajectory_msgs/")

    @property
    def width(self) -> int:
        """Numbers of a row."""
        return sum(column.length for column in self.columns)

    def content(self, rows: int = 1) -> Mapping[str, Any]:
        """Return the fields of our message with ``rows`` rows; its numbers may be omitted."""
        head = {"header": {"frame_id": self.topic.frame}}
        part: dict[str, list[Any]] = {
            path.partition("[")[0]: [0.0] * len(self.names) if path in ROWS else [{}]
            for path in self.fields
            if path in ROWS or "[" in path
        }
        if not self._is_trajectory:
            # names of other types have no such field, and are left out by the layout
            return {**head, "name": self.names, "joint_names": self.names, **part}
        after = [divmod(self.timebase.stamp_ns(i), 1_000_000_000) for i in range(rows)]
        points = [
            {**part, "time_from_start": {"sec": sec, "nanosec": nanosec}} for sec, nanosec in after
        ]
        return {**head, "joint_names": self.names, "points": points}

    def runs(self, message: Any) -> Iterable[Run]:
        """Yield the numbers of a decoded message, row by row, in the order of the columns.

        Raises:
            MessageError: the message does not fit this robot.
        """
        names = getattr(message, "name", getattr(message, "joint_names", None))
        order = [] if names is None else name_order(names, self.names, self.topic.full_name)
        if not self._is_trajectory:
            yield from self._part_runs(message, order, "")
            return
        if not message.points:
            raise MessageError(f"{self.topic.full_name}: a trajectory without points")
        for i, point in enumerate(message.points):
            after = point.time_from_start
            if after.sec * 1_000_000_000 + after.nanosec != self.timebase.stamp_ns(i):
                raise MessageError(
                    f"{self.topic.full_name}: point {i} is not {i} ticks after its message's stamp"
                )
            yield from self._part_runs(point, order, f"points[{i}].")

    def _part_runs(self, part: Any, order: list[int], prefix: str) -> Iterator[Run]:
        for path, columns in self.fields.items():
            values, _, is_of_body = path.partition("[")
            count = len(getattr(part, values)) if path in ROWS or is_of_body else 1
            if count != (len(order) if path in ROWS else 1):
                raise MessageError(
                    f"{self.topic.full_name}: {count} values of {values} for {len(self.names)} "
                    "names",
                    "size",
                )
            length = sum(column.length for column in columns)
            if path in ROWS:  # efforts of joints without motors are not in a sample
                yield Run(prefix + path, order[:length])
            else:
                yield Run(prefix + path, WXYZ if path.endswith("rotation") else XYZ[:length])

    def own(self, rows: int = 1) -> Numbers:
        """Return the layout of our message."""
        return self.learn(MessageLayout(self.topic.type, self.content(rows)).data)

    def learn(self, data: bytes) -> Numbers:
        """Return the layout of any message of the topic."""
        message = decode(data, self.topic.type)
        runs = list(self.runs(message))
        layout = MessageLayout(self.topic.type, message)
        places = [layout.slots[path].offset + 8 * i for path, order in runs for i in order]
        return Numbers(layout, np.array(places, np.uint64))


class TelemetryDescription(MessageDescription):
    """A std_msgs/Float64MultiArray with one labelled row per signal, and the tick as padding."""

    def content(self, rows: int = 1) -> Mapping[str, Any]:
        """Return the fields; the rows belong to one tick."""
        axes = self.names
        size = len(TELEMETRY_ROWS) * len(axes)
        dimensions = (
            ("signal: " + ", ".join(TELEMETRY_ROWS), len(TELEMETRY_ROWS), size),
            ("axis: " + ", ".join(axes), len(axes), len(axes)),
        )
        return {
            "layout": {
                "dim": [
                    {"label": label, "size": count, "stride": stride}
                    for label, count, stride in dimensions
                ],
                "data_offset": 1,
            },
            "data": [0.0] * (1 + size),
        }

    def runs(self, message: Any) -> Iterable[Run]:
        """Yield the tick, then the signals."""
        if not len(message.data):
            raise MessageError(f"{self.topic.full_name}: no tick")
        return (Run("data", range(len(message.data))),)


def describe(
    topic: Topic, names: RobotNames | Sequence[str], timebase: Timebase
) -> MessageDescription:
    """Return the description of a topic's messages, see `MessageDescription`."""
    kind = TelemetryDescription if topic is topics.TELEMETRY else MessageDescription
    return kind(topic, names, timebase)


def name_order(names: Sequence[str], expected: Sequence[str], topic: str) -> list[int]:
    """Return the index of each expected name in ``names``."""
    if sorted(names) != sorted(expected):
        raise MessageError(f"{topic}: names {list(names)}, expected {list(expected)}", "names")
    return [list(names).index(name) for name in expected]


class WritableMessage:
    """A message whose numbers and stamps are overwritten again and again."""

    def __init__(self, numbers: Numbers, stamps: Sequence[int]) -> None:
        """Lay out the message; ``stamps`` are the offsets of those to be written, bytes."""
        room = np.zeros(BODY + numbers.layout.pattern.shape[1], np.uint8)
        self._wire = room[BODY:]  # aligns the float64 in memory
        self._wire[:] = numbers.layout.pattern[0]
        self._body, self.words, self._stamps = body(self._wire), numbers.words, stamps

    def serialized(self, stamp_ns: int, values: Array) -> bytes:
        """Return the message with these numbers, and this time in all its stamps."""
        self._body[self.words] = values
        for offset in self._stamps:
            STAMP.pack_into(self._wire.data, offset, *divmod(stamp_ns, 1_000_000_000))
        return self._wire.tobytes()


class Codec:
    """Converts the messages of a topic by NumPy, for nodes without compiled code.

    A message with the layout of the last one is read by copying its numbers; a new layout is
    decoded in general form once.
    """

    def __init__(self, description: MessageDescription) -> None:
        """Create the codec for described messages."""
        self._description = description
        self._write_like(description.own())

    def _write_like(self, own: Numbers) -> None:
        self._message = WritableMessage(own, (BODY,) if self._description.topic.has_stamp else ())
        self._read_like(own)

    def _read_like(self, known: Numbers) -> None:
        self._pattern = known.layout.pattern
        self._from = known.words

    def encode(self, stamp_ns: int, values: Array) -> bytes:
        """Return the serialized message of all rows, flattened; its topic may have no stamp."""
        if values.size != self._message.words.size:
            self._write_like(self._description.own(values.size // self._description.width))
        return self._message.serialized(stamp_ns, values)

    def decode(self, data: bytes) -> tuple[int, Array]:
        """Return the stamp, ns, and the numbers of all rows, flattened, of a message of the topic.

        Raises:
            MessageError: the bytes are not a message of this topic and robot.
        """
        layout, constant = self._pattern
        if len(data) >= len(layout):  # other writers may append bytes
            message = np.frombuffer(data, np.uint8, len(layout))
            if not np.any((message ^ layout) & constant):
                return header_stamp_ns(data), body(message)[self._from]
        known = self._description.learn(data)
        self._read_like(known)
        return header_stamp_ns(known.layout.data), known.values
