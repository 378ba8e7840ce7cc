"""A flown flight: its log, metrics, figures and outcome."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Console
from typing_extensions import Self

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.arguments import as_path
from space_robot_msgs_py.config.text import html_table
from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import FlightError, InputError

from ..analysis import analyze
from ..analysis.own_metric import MetricFunction, finite_value
from ..analysis.report_tables import rms_table
from ..analysis.words import flown
from ..console.progress import flight_progress
from ..flight.compilation import compile_kernels
from ..flight.ending import COMPLETE, DIVERGED, Ending
from ..flight.flight_messages import check_bag_path, record
from ..flight.plan import Flight
from ..flight.simulate import simulate
from .flight_page import HEIGHT_PX, FlightPage, draw_page, show_page

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from pandas import DataFrame

    from ..analysis.figures.figure_set import FigureSet


class FlownFlight:
    """Result of `Scenario.fly` or `Bench.flown`, also of a flight that ended early."""

    def __init__(
        self,
        flight: Flight,
        ending: Ending,
        bag: Path | None,
        log: FlightLog,
        keep_log: bool = True,
        in_brief: bool = False,
    ) -> None:
        """``bag``: its folder, if recorded; ``keep_log``: False: only its report is kept.

        ``in_brief``: only what the terminal shows is in the report, see `analyze`.
        """
        self.flight, self.ending, self.bag = flight, ending, bag
        self._log: FlightLog | None = log
        self._in_brief = in_brief
        if not keep_log:
            _ = self._report
            self._log = None

    @property
    def log(self) -> FlightLog:
        """Log of the flight, one row per tick; an `InputError` if it was not kept."""
        if self._log is None:
            raise InputError("no log was kept (keep_log=False): record the flight and read its bag")
        return self._log

    @property
    def outcome(self) -> str:
        """``complete``, ``diverged`` or ``unanswered``.

        Diverged: the simulated state is not physical any more. Unanswered: the law has no command
        for a state (180 degrees from the desired attitude, or a number that is not finite).
        """
        return self.ending.outcome

    @property
    def reason(self) -> str:
        """Why the flight ended early, in a line; empty if it did not."""
        return self.ending.reason

    @property
    def ended_at_s(self) -> float:
        """Simulated time of the end, s."""
        return float(self.ending.ended_at_s or 0.0)

    @property
    def is_complete(self) -> bool:
        """True if the flight reached its planned end."""
        return self.outcome == COMPLETE

    def check(self) -> Self:
        """Return the flight if it is complete, or raise the `FlightError` that ended it."""
        self.ending.check()
        return self

    @cached_property
    def metrics(self) -> dict[str, float]:
        """Metrics of the flight by name, such as ``joints_1_3.rms`` or ``base_torque.ripple``.

        They are those of ``space-robot analyze --json``; `space_robot.analysis.describe` has the
        unit and meaning of each. Empty if the flight has no complete tick.
        """
        return dict(self._report.get("metrics", {}))

    def metric(self, function: MetricFunction | str) -> float:
        """Return a metric of your own: a function of the log, or ``file.py:FUNCTION``.

        Raises:
            InputError: no log was kept; the function cannot be imported, raised an error, or
                returned no finite number.
        """
        return finite_value(function, self.log)

    @cached_property
    def table(self) -> DataFrame:
        """Log as a pandas data frame, with the columns of ``analyze --csv``."""
        from ..analysis.export import dataframe  # slow to import

        return dataframe(self.log)

    def report(self) -> dict[str, Any]:
        """Return metrics, outcome, reason and end, as ``space-robot simulate --json`` prints."""
        return flight_report(self.flight, self.ending, self._report, self.bag)

    @cached_property
    def _report(self) -> dict[str, Any]:
        try:
            return analyze(self.log, in_brief=self._in_brief)
        except InputError:
            return {}

    @property
    def plots(self) -> list[str]:
        """Names of the figures that `plot` draws."""
        return list(self._figures.drawings())

    def plot(
        self,
        name: str = "control_results",
        path: str | Path | None = None,
        *,
        width: str | float | None = None,
        formats: Sequence[str] = ("png", "svg"),
    ) -> Figure:
        """Draw a figure of ``space-robot analyze --plot``.

        Args:
            name: one of `plots`.
            path: of the files, without suffix; None: no file, for notebooks.
            width: for a paper: "single", "double" or mm, without a title; None: 180 mm.
            formats: of the files: png, svg, pdf.

        Raises:
            InputError: there is no such figure, width or format, or it cannot be written.
        """
        from ..analysis.figures.style import parse_width, save_figure  # slow to import

        figures = self._figures if width is None else self._figures_of(parse_width(width))
        drawings = figures.drawings()
        file = None if path is None else as_path(path, "path")
        figure = drawings[one_of(name, drawings, "figure")].draw()
        if file is not None:
            save_figure(figure, file, formats)
        return figure

    def save(self, bag: str | Path) -> Path:
        """Write the flight into a new folder ``bag``, as ``fly(bag=...)`` does; return its path.

        Raises:
            InputError: no log was kept, the bag cannot be written, or messages failed in flight.
        """
        path = as_path(bag, "bag")
        if self.flight.flies_by_messages:
            raise InputError("messages of this flight failed: record them by fly(bag=...)")
        check_bag_path(path)
        record(self.flight, self.log, path)
        self.bag = path
        return path

    def view(
        self,
        *others: FlownFlight,
        path: str | Path | None = None,
        rate: float = 30.0,
        title: str = "",
        light: bool = False,
        side_by_side: bool = False,
        plots: Sequence[str] = (),
        opens: bool = True,
        height: int = HEIGHT_PX,
    ) -> FlightPage:
        """Show the flight in 3-D with plots, as ``space-robot view``.

        In a notebook the page appears as the value of the cell, and needs no network. Elsewhere it
        is written to a file and opened in a browser.

        Args:
            others: flights drawn over this one, named by their laws.
            path: file to write, replaced if it exists; None: none in a notebook, elsewhere
                ``<law>_view.html`` in the working folder.
            rate: poses per second of flight.
            title: of the page; empty: the laws.
            light: dark on white, to print.
            side_by_side: a place for each robot.
            plots: kinds shown first, as by ``--plots``; empty: the usual ones.
            opens: False: the file is not opened in a browser.
            height: of the page in a notebook, px.

        Raises:
            InputError: viser is not installed, no log was kept, a plot is unknown, another one is
                no flight, or the file cannot be written.
        """
        from ..analysis.plotted import parse_kinds
        from ..view.flights import ViewOptions  # slow to import

        flights = (self, *others)
        for other in others:
            if not isinstance(other, FlownFlight):
                raise InputError(f"others: flights were expected, got {short(other)}")
        kinds = parse_kinds(",".join(plots)) if plots else ()
        options = ViewOptions(side_by_side, rate, title, not light, kinds)
        logs, robots = zip(*((flight.log, flight.flight.robot) for flight in flights), strict=True)
        page = FlightPage(draw_page(logs, robots, options), height)
        if Console().is_jupyter:
            if path is not None:
                page.save(path)
        else:
            law = str(self.log.flight.get("controller", "flight"))
            show_page(page, f"{law}_view.html" if path is None else path, opens)
        return page

    def __repr__(self) -> str:
        end = "" if self.is_complete else f": {self.reason}"
        what = flown(self.flight.description)
        return f"<FlownFlight: {what}, {self.ended_at_s:g} s, {self.outcome}{end}>"

    def _repr_html_(self) -> str:
        caption = repr(self)[1:-1]
        if not self.metrics:
            return html_table((), (), caption)
        table = rms_table(self.report())
        rows = [row for group in table.groups for row in table.texts(group)]
        return html_table([column.heading for column in table.columns], rows, caption)

    @cached_property
    def _figures(self) -> FigureSet:
        return self._figures_of(None)

    def _figures_of(self, width: float | None) -> FigureSet:
        from ..analysis.figures.figure_set import FigureSet  # slow to import

        figures = FigureSet(width=width)
        figures.add("flight", self.log.longest_stretch())
        return figures


FLOWN = (
    "controller",
    "case",
    "gains",
    "own_gains",
    "robot",
    "mission",
    "sensors",
    "period",
    "swaps",
    "faults",
    "events",
    "disturbance",
)


def flight_report(
    flight: Flight, ending: Ending, metrics: dict[str, Any], bag: Path | None
) -> dict[str, Any]:
    """Return the ``metrics`` of a flight with ``outcome``, ``reason`` and ``ended_at_s``.

    For a flight that ended early also its description, ``planned_ticks``, ``bag``, ``error`` and,
    if it ``diverged``, the tick and time.
    """
    if ending.error is None:
        return metrics | ending.as_record()
    planned, diverged = flight.description, {"tick": ending.tick, "time_s": ending.ended_at_s}
    return {
        **{key: planned[key] for key in FLOWN if key in planned},
        **metrics,
        "planned_ticks": flight.ticks,
        "bag": str(bag) if bag and bag.exists() else None,
        "diverged": diverged if ending.outcome == DIVERGED else None,
        "error": ending.reason,
        **ending.as_record(),
    }


def fly_in_process(
    flight: Flight,
    bag: Path | None = None,
    progress: Callable[[float], object] | bool | None = None,
    keep_log: bool = True,
    in_brief: bool = False,
) -> FlownFlight:
    """Fly a checked flight from the present state of its plant; see `Scenario.fly`.

    ``in_brief``: see `FlownFlight`.
    """
    if bag:
        check_bag_path(bag)
    compile_kernels(bool(flight.plant.names.actuators))  # has a progress line of its own
    if progress is True:
        _ = flight.supervisor  # compiled, or refused, before the line begins
        with flight_progress(flight.ticks * flight.period, flight.law.name) as show_time:
            return fly_in_process(flight, bag, show_time, keep_log, in_brief)

    def show(tick: int) -> None:
        if callable(progress):
            progress(tick * flight.period)

    try:
        log = simulate(flight, bag, show, is_kept=keep_log)
        ending = Ending.complete(flight.ticks, flight.period)
    except FlightError as error:
        if error.log is None:
            raise
        log, ending = error.log, Ending.early(error, flight.period)
    return FlownFlight(flight, ending, bag, log, keep_log, in_brief)
