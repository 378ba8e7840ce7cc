"""Messages of a type that is not installed, transported in another message.

Publishers and subscribers need the compiled support of a type, even for serialized bytes. That of
tf2_msgs is not on any Python index, so the recorder receives the bytes of /tf in a
std_msgs/UInt8MultiArray.
"""

from __future__ import annotations

import struct

from .cdr import ENCAPSULATION

_HEAD = struct.Struct("<4sIII")
"""Encapsulation header, no dimensions, no offset, length of the data."""


def wrap(data: bytes) -> bytes:
    """Return the carrier of a serialized message."""
    return _HEAD.pack(ENCAPSULATION, 0, 0, len(data)) + data


def unwrap(data: bytes) -> bytes:
    """Return the serialized message in a carrier from `wrap`."""
    return data[_HEAD.size :]
