"""Byte layout of messages, from their definitions: constant bytes and positions of numbers.

Names and lengths in the messages of a flight are constant, so the bytes between the numbers never
change. A `MessageLayout` describes all messages that differ only in numbers.

Plain CDR, little endian: a primitive is aligned to its size, counted from the end of the 4-byte
encapsulation header; a string is its length (with NUL), bytes, NUL; a sequence is its length,
then its elements.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype

from ..errors import MessageError
from .definitions import jazzy

Bytes = NDArray[np.uint8]

ENCAPSULATION = b"\x00\x01\x00\x00"  # little endian, no options
BODY = len(ENCAPSULATION)
BIG_ENDIAN = b"\x00\x00"
"""First bytes of a big-endian message."""
STAMP = struct.Struct("<iI")
_BIG_STAMP = struct.Struct(">iI")
TIME = "builtin_interfaces/msg/Time"
_PRIMITIVES = {
    name: struct.Struct(f"<{letter}")
    for letter, names in (
        *(("?", "bool"), ("B", "byte octet char uint8"), ("b", "int8"), ("H", "uint16")),
        *(("h", "int16"), ("I", "uint32"), ("i", "int32"), ("Q", "uint64"), ("q", "int64")),
        *(("f", "float32"), ("d", "float64")),
    )
    for name in names.split()
}
_LENGTH = _PRIMITIVES["uint32"]
_NUMBER = (Nodetype.BASE, ("float64", 0))


class Slot(NamedTuple):
    """Position of consecutive float64 numbers in a message."""

    offset: int
    """Offset from the start of the message, bytes."""
    length: int


class MessageLayout:
    """Bytes of a message, and positions of its numbers.

    Numbers are every float64 and Time; everything else, such as names, lengths and other integers,
    is equal in all messages of a layout.
    """

    def __init__(self, type_name: str, content: Any) -> None:
        """Compute the layout of a message.

        Args:
            type_name: such as ``sensor_msgs/msg/JointState``.
            content: the decoded message, or a mapping of its fields; missing fields are zero or
                empty.
        """
        walk = _Walk()
        walk.message(type_name, content, "")
        self.pattern: Bytes = np.full((2, BODY + len(walk.body)), 0xFF, np.uint8)
        """Bytes of the message, and mask of the bits that are constant in the layout."""
        self.pattern[0] = np.frombuffer(ENCAPSULATION + walk.body, np.uint8)
        for start, stop in walk.changing:
            self.pattern[1, BODY + start : BODY + stop] = 0
        self.slots = walk.slots
        """Slots of float64 by path, such as ``transforms[0].translation``."""
        self.stamps = tuple(walk.stamps)
        """Offsets of all Times, bytes from the start of the message."""

    @property
    def data(self) -> bytes:
        """Return the serialized message."""
        data: bytes = self.pattern[0].tobytes()
        return data


class _Walk:
    def __init__(self) -> None:
        self.body = bytearray()
        self.changing: list[tuple[int, int]] = []
        """Bytes that may differ: numbers, and padding, which writers may fill arbitrarily."""
        self.slots: dict[str, Slot] = {}
        self.stamps: list[int] = []

    def message(self, type_name: str, content: Any, path: str) -> None:
        """Write a message or a nested message."""
        fields = _fields(type_name)
        values = [_value(content, name) for name, _ in fields]
        if type_name == TIME:
            self._align(4)
            self.stamps.append(BODY + len(self.body))
            self._change(STAMP.pack(*(value or 0 for value in values)))
        elif all(description == _NUMBER for _, description in fields):
            self._numbers([0.0 if value is None else value for value in values], path)
        else:
            for (name, description), value in zip(fields, values, strict=True):
                self._field(description, value, f"{path}.{name}" if path else name)

    def _field(self, description: Any, value: Any, path: str) -> None:
        kind, of = description
        if kind is Nodetype.BASE and of[0] == "string":
            text = (value or "").encode() + b"\0"
            self._primitive(_LENGTH, len(text))
            self.body += text
        elif description == _NUMBER:
            self._numbers([0.0 if value is None else value], path)
        elif kind is Nodetype.BASE:
            self._primitive(_PRIMITIVES[of[0]], value or 0)
        elif kind is Nodetype.NAME:
            self.message(of, value, path)
        else:
            element, count = of
            items = [None] * count if value is None else value  # empty for a missing sequence
            if kind is Nodetype.SEQUENCE:
                self._primitive(_LENGTH, len(items))
            if element == _NUMBER:
                self._numbers(np.zeros(count) if value is None else items, path)
            else:
                for i, item in enumerate(items):
                    self._field(element, item, f"{path}[{i}]")

    def _primitive(self, form: struct.Struct, value: Any) -> None:
        self._align(form.size)
        self.body += form.pack(value)

    def _numbers(self, values: Any, path: str) -> None:
        if len(values):  # no padding after an empty sequence
            self._align(8)
        self.slots[path] = Slot(BODY + len(self.body), len(values))
        self._change(np.asarray(values, "<f8").tobytes())

    def _align(self, size: int) -> None:
        self._change(bytes(-len(self.body) % size))

    def _change(self, data: bytes) -> None:
        if data:
            self.changing.append((len(self.body), len(self.body) + len(data)))
            self.body += data


@cache
def _fields(type_name: str) -> list[Any]:
    return list(jazzy().get_msgdef(type_name).fields)


def _value(content: Any, name: str) -> Any:
    if content is None:
        return None
    return content.get(name) if isinstance(content, Mapping) else getattr(content, name)


def header_stamp_ns(data: bytes, at: int = 0) -> int:
    """Return the stamp, ns, of a message whose Header or Time stands behind ``at`` bytes.

    Raises:
        MessageError: the message is too short.
    """
    try:
        form = _BIG_STAMP if data.startswith(BIG_ENDIAN) else STAMP
        sec, nanosec = form.unpack_from(data, BODY + at)
    except struct.error:
        raise MessageError(f"a message of {len(data)} bytes has no stamp") from None
    return int(sec * 1_000_000_000 + nanosec)
