"""A flight that was flown: its log, its metrics, its figures, and how it ended."""

from __future__ import annotations

from functools import cached_property
from html import escape
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure
from typing_extensions import Self

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError

from ..analysis import analyze
from ..analysis.figures.figure_set import FigureSet
from ..analysis.figures.style import save_figure
from ..analysis.report_tables import rms_table
from ..analysis.words import flown
from ..flight.ending import COMPLETE, Ending


class FlownFlight:
    """What came of a `Scenario.fly`, to its end or not."""

    def __init__(self, log: FlightLog, ending: Ending, bag: Path | None = None) -> None:
        """Take what was flown, how that ended, and where it was recorded."""
        self.log, self.ending, self.bag = log, ending, bag

    @property
    def outcome(self) -> str:
        """``complete``, ``diverged`` or ``unanswered``.

        Diverged: the state left the physics. Unanswered: the law has no command for a state (the
        attitude is near 180 degrees, a number is not finite).
        """
        return self.ending.outcome

    @property
    def reason(self) -> str:
        """Why it ended before its time, in a line; empty if it did not."""
        return self.ending.reason

    @property
    def ended_at_s(self) -> float:
        """Simulated time of its end, s."""
        return float(self.ending.ended_at_s or 0.0)

    @property
    def is_complete(self) -> bool:
        """True if it came to its planned end."""
        return self.outcome == COMPLETE

    def check(self) -> Self:
        """Return the flight itself, if it came to its end.

        Raises:
            FlightError: it did not; the one that ended it.
        """
        self.ending.check()
        return self

    @cached_property
    def metrics(self) -> dict[str, Any]:
        """The metrics of ``space-robot analyze --json``, of what was flown.

        The columns of Table V stand by their own names, too, as mean-axis RMS:
        ``metrics["attitude"]`` is ``metrics["rms"]["mean_axis"]["attitude"]``. Empty if the flight
        has not one whole tick.
        """
        try:
            report = analyze(self.log)
        except InputError:
            return {}
        return {**report["rms"]["mean_axis"], **report}

    def report(self) -> dict[str, Any]:
        """Return what ``space-robot simulate --json`` prints: metrics, outcome, reason, end."""
        columns = self.metrics.get("rms", {}).get("mean_axis", ())
        metrics = {name: value for name, value in self.metrics.items() if name not in columns}
        return metrics | self.ending.as_record()

    @property
    def plots(self) -> list[str]:
        """Names of the figures that `plot` draws."""
        return list(self._figures.drawings())

    def plot(self, name: str = "control_results", path: str | Path | None = None) -> Figure:
        """Draw a figure of ``space-robot analyze --plot``.

        Args:
            name: one of `plots`.
            path: of the file, without its ending, to write as PNG and SVG; None: nothing is
                written, a notebook shows the figure.

        Raises:
            InputError: there is no such figure, or it cannot be written.
        """
        drawings = self._figures.drawings()
        figure = drawings[one_of(name, drawings, "figure")].draw()
        if path is not None:
            save_figure(figure, Path(path))
        return figure

    def __repr__(self) -> str:
        end = "" if self.is_complete else f" at {self.ended_at_s:g} s: {self.reason}"
        return (
            f"<FlownFlight: {flown(self.log.flight)}, {self.log.ticks} ticks, {self.outcome}{end}>"
        )

    def _repr_html_(self) -> str:
        """Show outcome and RMS in a notebook."""
        lines = [f"<p>{escape(repr(self)[1:-1])}</p>"]
        if self.metrics:
            table = rms_table(self.report())
            heads = "".join(f"<th>{escape(column.heading)}</th>" for column in table.columns)
            rows = [
                "".join(f"<td>{escape(text)}</td>" for text in row)
                for group in table.groups
                for row in table.texts(group)
            ]
            body = "".join(f"<tr>{row}</tr>" for row in rows)
            lines.append(f"<table><tr>{heads}</tr>{body}</table>")
        return "".join(lines)

    @cached_property
    def _figures(self) -> FigureSet:
        figures = FigureSet()
        figures.add("flight", self.log.longest_stretch())
        return figures
