"""Health of a node, as reported in /diagnostics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum

SENT = "sent "
"""Before a topic's name: the key of how many messages the node's publisher has sent on it."""


class Level(IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class Health:
    """Health of a node at one moment."""

    mode: str
    """The mode in a word or two, then why: ``nominal``, ``safe: no state for 0.5 s``."""
    level: Level = Level.OK
    values: Mapping[str, float | int | str] = field(default_factory=dict)
    """Readings, by name with unit; ``tick`` is the last one dealt with."""
