"""The ROS 2 message definitions: texts, hashes, and a general decoder."""

from __future__ import annotations

import os
import re
import struct
import sys
from functools import cache
from pathlib import Path
from typing import Any

from rosbags.serde import SerdeError
from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from ..errors import MessageError

_FIELD = re.compile(r"^([A-Za-z]\w*(?:/[A-Z]\w*)?)(?:\[.*?\])?\s+[a-z]\w*", re.MULTILINE)


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
    """Return the ``ros2msg`` text of a type with all nested types, as stored by rosbag2.

    It is read from the ``.msg`` files of the installed ROS 2, with comments, or without ROS from
    rosbags, which has the same fields.
    """
    root = type_name.replace("/msg/", "/")
    texts: dict[str, str] = {}
    waiting = [root]
    while waiting:
        name = waiting.pop(0)
        if name in texts:
            continue
        text = _installed(name)
        if text is None:
            return jazzy().generate_msgdef(type_name, ros_version=2)[0]
        texts[name] = text
        package = name.partition("/")[0]
        for field in _FIELD.findall(text):
            if "/" in field or field[0].isupper():
                waiting.append(field if "/" in field else f"{package}/{field}")
    head = texts.pop(root)
    return head + "".join(f"\n{'=' * 80}\nMSG: {name}\n{text}" for name, text in texts.items())


def _installed(name: str) -> str | None:
    """Return the ``.msg`` text of ``package/Type`` from the installed ROS; None if not found."""
    package, _, type_name = name.partition("/")
    prefixes = [p for p in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if p]
    for prefix in [*prefixes, sys.prefix]:
        file = Path(prefix) / "share" / package / "msg" / f"{type_name}.msg"
        if file.is_file():
            return file.read_text(encoding="utf-8")
    return None
