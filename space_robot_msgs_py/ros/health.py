"""Health of a node, as reported in /diagnostics."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import IntEnum

SENT = "sent "
"""Prefix of a topic's name in the key of its number of sent messages."""


class Level(IntEnum):
    """Levels of diagnostic_msgs/DiagnosticStatus."""

    OK = 0
    WARN = 1
    ERROR = 2


@dataclass(frozen=True, slots=True)
class Health:
    """Health of a node at one time."""

    mode: str
    """Mode and reason: ``nominal``, ``safe: no state for 0.5 s``."""
    level: Level = Level.OK
    values: Mapping[str, float | int | str] = field(default_factory=dict)
    """Values by name with unit; ``tick`` is the last processed one."""
