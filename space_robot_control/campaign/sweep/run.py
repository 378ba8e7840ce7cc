"""Flies a sweep in processes side by side."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, NamedTuple

from space_robot_msgs_py.errors import FlightError

from ...analysis import Analysis
from ...flight.plan import Flight
from ...flight.simulate import fly_blocks
from ..runner import run_all
from .scenario import Draw, Sweep


class Row(NamedTuple):
    """A flight of a sweep and what came of it."""

    draw: Draw
    failure: str
    """Why it ended early; empty if it did not."""
    metrics: dict[str, float]
    """Mean-axis RMS of errors and torques, and of the torques' ripple; none of a failed flight."""

    def as_record(self) -> dict[str, Any]:
        """Return it as a flat dictionary."""
        law, sensors, number, actuators = self.draw
        return {
            "controller": law.controller, "gains": law.gains, "sensors": sensors,
            "actuators": actuators, "draw": number, "failure": self.failure, **self.metrics,
        }  # fmt: skip


def sweep(
    study: Sweep,
    jobs: int = 1,
    progress: Callable[[int], Callable[[], None]] = lambda total: lambda: None,
) -> list[Row]:
    """Fly every flight of ``study``; the rows do not depend on the number of processes.

    Args:
        study: the flights.
        jobs: processes at work.
        progress: called with the number of flights, gives what is called after each.

    Raises:
        InputError: an option that cannot be; nothing is flown then.
    """
    for draw in study.flights():
        if not draw.number:
            Flight(study.plan(draw))
    return run_all(partial(fly, study), list(study.flights()), jobs, progress)


def fly(study: Sweep, draw: Draw) -> Row:
    """Fly one flight of ``study``."""
    analysis = Analysis()
    try:
        for block in fly_blocks(Flight(study.plan(draw))):
            analysis.add(block)
    except FlightError as error:
        return Row(draw, str(error), {})
    return Row(draw, "", metrics(analysis.report()))


def metrics(report: dict[str, Any]) -> dict[str, float]:
    """Return the figures of merit of a flight's report by name."""
    found: dict[str, float] = dict(report["rms"]["mean_axis"])
    if ripple := report["ripple"]:
        for name, bands in (("ripple", ripple), ("fast_ripple", ripple["fast"])):
            found |= {f"{name}_{group}": value for group, value in bands["rms"].items()}
    return found
