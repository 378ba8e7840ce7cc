"""Result of one check of the machine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, NamedTuple

Status = Literal["ok", "warning", "missing"]
ROS = "ROS 2"
"""Name of the check of ROS 2 itself."""


class CheckedItem(NamedTuple):
    """What was found, how good it is, and what to do about it."""

    name: str
    status: Status
    text: str
    """What was found, in a line."""
    advice: str = ""
    """What to do; empty if there is nothing to do."""
    values: Mapping[str, Any] = {}
    """The same as numbers and names, for programs."""
    is_required: bool = False
    """True if no flight can run in one process while this is missing."""

    @property
    def prevents_flights(self) -> bool:
        """True if no flight can run in one process because of it."""
        return self.is_required and self.status == "missing"

    def as_record(self) -> dict[str, Any]:
        """Return the item for JSON."""
        return {
            "name": self.name,
            "status": self.status,
            "text": self.text,
            "advice": self.advice,
            "values": dict(self.values),
        }
