"""Late subscribers of a paused graph, which have missed earlier messages."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

PERIOD_S = 0.5
MOST_S = 2.0
"""Messages are repeated for this long: who takes them as best effort may miss the first."""


class Output(Protocol):
    """A publisher, as far as it is needed here."""

    @property
    def listener_count(self) -> int:
        """Number of subscriptions that are connected."""


class LateListeners:
    """Decision when a paused plant repeats its last messages. Independent of ROS."""

    def __init__(self, outputs: Sequence[Output]) -> None:
        """``outputs``: their new listeners are those meant."""
        self._outputs = outputs
        self._counts: list[int] | None = None
        self._until = self._next = 0.0

    def begin(self) -> None:
        """Begin a tick: who listens by now gets its messages."""
        self._counts = None

    def are_due(self, now: float) -> bool:
        """Return whether messages must be repeated for new listeners, at a time in s."""
        before = self._counts
        self._counts = [output.listener_count for output in self._outputs]
        if before and any(a > b for a, b in zip(self._counts, before, strict=True)):
            self._next, self._until = now, now + MOST_S
        if not self._next <= now < self._until:
            return False
        self._next = now + PERIOD_S
        return True
