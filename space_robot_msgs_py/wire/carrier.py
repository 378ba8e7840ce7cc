"""Messages of a type that is not installed, as the bytes of one that is.

Who publishes or takes a message needs the compiled support of its type, even for serialized bytes.
That of tf2_msgs is on no Python index, so the recorder is sent the very bytes of /tf in a
std_msgs/UInt8MultiArray.
"""

from __future__ import annotations

import struct

from .cdr import ENCAPSULATION

_HEAD = struct.Struct("<4sIII")
"""Encapsulation, dimensions, offset of the data: none; length of the data."""


def wrap(data: bytes) -> bytes:
    """Return the carrier of a serialized message."""
    return _HEAD.pack(ENCAPSULATION, 0, 0, len(data)) + data


def unwrap(data: bytes) -> bytes:
    """Return the serialized message in a carrier that `wrap` made."""
    return data[_HEAD.size :]
