"""How a flight ended: at its planned end, or before, and why."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from space_robot_msgs_py.errors import DivergedError, FlightError, UnusableStateError

COMPLETE, DIVERGED, UNANSWERED, FAILED = "complete", "diverged", "unanswered", "failed"
"""Outcomes: flown to its end; the state left the physics; the law has no command for a state (the
attitude is near 180 degrees, a number is not finite); a node or its messages failed."""
_DIVERGED = re.compile(r"diverged at tick (\d+)")


class Ending(NamedTuple):
    """The end of a flight."""

    outcome: str
    """`COMPLETE`, `DIVERGED`, `UNANSWERED` or `FAILED`."""
    reason: str
    """Why it ended before its time, in a line; empty if it did not."""
    tick: int | None
    """Tick of the end; None: not known."""
    ended_at_s: float | None
    """The same in simulated seconds."""
    error: FlightError | None = None
    """What was raised."""

    @classmethod
    def complete(cls, ticks: int, period: float) -> Ending:
        """A flight of ``ticks`` of ``period`` s came to its end."""
        return cls(COMPLETE, "", ticks, _seconds(ticks, period))

    @classmethod
    def early(cls, error: FlightError, period: float) -> Ending:
        """A flight was ended by ``error``; of a graph's only the words tell how."""
        outcome, tick = FAILED, None
        if isinstance(error, UnusableStateError):
            outcome, tick = UNANSWERED, error.tick
        elif isinstance(error, DivergedError):
            outcome, tick = DIVERGED, error.tick
        elif match := _DIVERGED.search(str(error)):
            outcome, tick = DIVERGED, int(match[1])
        return cls(outcome, str(error), tick, _seconds(tick, period), error)

    def as_record(self) -> dict[str, Any]:
        """Return what a report tells of it."""
        return {"outcome": self.outcome, "reason": self.reason, "ended_at_s": self.ended_at_s}

    def check(self) -> None:
        """See that the flight came to its end.

        Raises:
            FlightError: it did not.
        """
        if self.error is not None:
            raise self.error


def _seconds(tick: int | None, period: float) -> float | None:
    return None if tick is None else round(tick * period, 9)
