"""What a node does: its `Loop`, which its host steps and which never waits, and its `Health`.

So a host can step one or several nodes in a process.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from typing import NamedTuple, Protocol

from .endpoints import RawPublisher, RawSubscription

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


class Wait(NamedTuple):
    """Time and messages that an idle loop waits for."""

    seconds: float
    """Timeout after which the loop is stepped in any case."""
    inputs: tuple[RawSubscription, ...] = ()
    """Subscriptions; the loop is stepped as soon as one of them has a message."""
    is_brief: bool = False
    """True if a message is expected soon, so that polling is faster than sleeping."""
    is_for_others: bool = False
    """True if the loop only yields: the wait ends when the other nodes of the process were
    stepped."""
    patience_s: float = 0.0
    """Allowed extension while other nodes of the process are busy."""


class Loop(Protocol):
    """Work of a node; created by configure, stepped while the node is active."""

    @property
    def outputs(self) -> Sequence[RawPublisher]:
        """Publishers of topics that no other node may publish."""

    @property
    def wait_for(self) -> Sequence[str]:
        """Subscribers required before the first step: ``NODE:TOPIC``, ``NODE`` for all topics."""

    @property
    def is_complete(self) -> bool:
        """True if the loop, and thereby the flight, has ended."""

    def begin(self) -> None:
        """Prepare for stepping; called on activate."""

    def step(self) -> Wait | None:
        """Run one step without waiting.

        Returns:
            What to wait for; None if work was done and there may be more.
        """

    def deactivate(self) -> None:
        """Put the graph into a safe state; called on deactivate and before an active node ends."""

    def close(self) -> None:
        """Release all resources; called on cleanup and at the end.

        Raises:
            FlightError: the results are incomplete.
        """

    def health(self) -> Health:
        """Return the health of the node; called several times per second."""
