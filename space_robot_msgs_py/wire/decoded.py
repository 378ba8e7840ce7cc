"""Fields of messages that were decoded the general way."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from ..errors import MessageError


def stamp_of(message: Any) -> int:
    """Header stamp of a decoded message, ns."""
    stamp = message.header.stamp
    return int(stamp.sec * 1_000_000_000 + stamp.nanosec)


def name_order(given: Sequence[str], expected: Sequence[str], topic: str) -> list[int]:
    """Where each expected name stands among the given ones.

    Raises:
        MessageError: other names than expected.
    """
    if sorted(given) != sorted(expected):
        raise MessageError(f"{topic}: names {list(given)}, expected {list(expected)}", "names")
    return [list(given).index(name) for name in expected]
