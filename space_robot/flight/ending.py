"""End of a flight: complete, or early with a reason."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

from space_robot_msgs_py.errors import DivergedError, FlightError, UnusableStateError

COMPLETE, DIVERGED, UNANSWERED, FAILED = "complete", "diverged", "unanswered", "failed"
"""Outcomes: flown to its end; the state left the physics; the law has no command for a state (the
attitude error is near 180 degrees, a number is not finite); a node or its messages failed."""
STOPPED = "stopped"
"""Outcome of a flight on a bench that goes on, or was left there."""
_DIVERGED = re.compile(r"diverged at tick (\d+)")


class Ending(NamedTuple):
    """The end of a flight."""

    outcome: str
    """`COMPLETE`, `DIVERGED`, `UNANSWERED`, `FAILED` or `STOPPED`."""
    reason: str
    """Reason of an early end, in one line; empty otherwise."""
    tick: int | None
    """Tick of the end; None: unknown."""
    ended_at_s: float | None
    """Simulated time of the end, s."""
    error: FlightError | None = None
    """Exception that ended the flight."""

    @classmethod
    def complete(cls, ticks: int, period: float) -> Ending:
        """Return the end of a complete flight of ``ticks`` of ``period`` s."""
        return cls(COMPLETE, "", ticks, _seconds(ticks, period))

    @classmethod
    def early(cls, error: FlightError, period: float) -> Ending:
        """Return the end of a flight stopped by ``error``; for a graph, from its message."""
        outcome, tick = FAILED, None
        if isinstance(error, UnusableStateError):
            outcome, tick = UNANSWERED, error.tick
        elif isinstance(error, DivergedError):
            outcome, tick = DIVERGED, error.tick
        elif match := _DIVERGED.search(str(error)):
            outcome, tick = DIVERGED, int(match[1])
        return cls(outcome, str(error), tick, _seconds(tick, period), error)

    @classmethod
    def stopped(cls, tick: int, period: float) -> Ending:
        """Return the end of a flight that was left at a tick on a bench."""
        seconds = _seconds(tick, period)
        return cls(STOPPED, f"stopped on the bench at {seconds:g} s", tick, seconds)

    def as_record(self) -> dict[str, Any]:
        """Return the end as a record for reports."""
        return {"outcome": self.outcome, "reason": self.reason, "ended_at_s": self.ended_at_s}

    def check(self) -> None:
        """Raise the error that ended the flight early, if one did."""
        if self.error is not None:
            raise self.error


def _seconds(tick: int | None, period: float) -> float | None:
    return None if tick is None else round(tick * period, 9)
