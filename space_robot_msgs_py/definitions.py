"""The ROS 2 message definitions, from rosbags: names, texts, hashes, and a general decoder."""

from __future__ import annotations

from functools import cache
from typing import Any

from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore


@cache
def jazzy() -> Typestore:
    """The message types of ROS 2 Jazzy."""
    return get_typestore(Stores.ROS2_JAZZY)


def decode(data: bytes, type_name: str) -> Any:
    """Any message of Jazzy from its CDR bytes (slow; the codecs are the fast way)."""
    return jazzy().deserialize_cdr(data, type_name)
