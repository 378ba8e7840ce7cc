"""The ROS 2 message definitions: texts, hashes, and a general decoder."""

from __future__ import annotations

import struct
from functools import cache
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from ..errors import MessageError


@cache
def jazzy() -> Typestore:
    """Return the message types of ROS 2 Jazzy, from rosbags."""
    return get_typestore(Stores.ROS2_JAZZY)


def decode(data: bytes, type_name: str) -> Any:
    """Decode any message of Jazzy from its CDR bytes (slow; the codecs are faster).

    Bytes after the message are ignored: rclpy's serializer appends some.

    Raises:
        MessageError: the bytes are not a message of this type.
    """
    definition = jazzy().get_msgdef(type_name)
    parse = {b"\0\1": definition.deserialize_cdr_le, b"\0\0": definition.deserialize_cdr_be}
    try:
        message, _ = parse[data[:2]](data[4:], 0, definition.cls, jazzy())
    except (KeyError, struct.error, IndexError, ValueError, SerdeError) as error:
        raise MessageError(f"not a {type_name}: {error}") from None
    return message


@cache
def definition(type_name: str) -> str:
    """Return the ``ros2msg`` text of a type with all nested types, as rosbag2 stores it."""
    return jazzy().generate_msgdef(type_name, ros_version=2)[0]
