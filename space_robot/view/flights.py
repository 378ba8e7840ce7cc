"""The page of flights: one HTML file with the scene, synchronised plots and marks."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.resources import files
from itertools import cycle, pairwise
from typing import Any, NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot, robot_as_path
from space_robot_model.robot.parts import Spring
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import LawChange, as_data, in_words, laws_of
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.events import Capture
from space_robot_sim.faults.grammar import parse_fault

from ..analysis.analysed_log import AnalysedLog
from ..analysis.described import check_joints, flown_events, flown_robot
from ..analysis.plotted import PlottedQuantity, flown_quantities
from ..analysis.report import template
from ..scenario.faults import KINDS
from .actuators import actuator_notes
from .animation import ShownFlight, animate
from .frames import RATE_HZ, shown_times
from .orbit import arrow_colours, is_in_orbit, shadow_intervals, sun_direction
from .scene import palette
from .shapes import shown_shapes

STRETCHES = 400
"""Time intervals of a flight; minimum and maximum of each are drawn, so that chatter is visible."""


@dataclass(frozen=True)
class ViewOptions:
    """Options of a page."""

    side_by_side: bool = False
    """True to draw robots side by side, even if all are the same."""
    rate: float = RATE_HZ
    """Poses per second of flight."""
    title: str = ""
    """Title of the page; empty: the flights' names."""
    dark: bool = True
    """True for light on dark."""
    plots: tuple[str, ...] = ()
    """Kinds of the plots that are shown first, see `plotted.KINDS`; empty: the usual ones."""


class Series(NamedTuple):
    """A line of a plot, as the page's script has it."""

    label: str
    colour: str
    values: Array
    """(K,) values."""
    wanted: bool = False
    """True for desired values."""


class Plot(NamedTuple):
    """A plot over time, as the page's script has it."""

    title: str
    unit: str
    series: Sequence[Series]
    logarithmic: bool = False
    pulses: bool = False
    """True if each series has a separate row, for values from 0 to 1."""
    limits: Sequence[float] = ()
    """Values at which a line goes across."""
    kind: str = ""
    """One of `space_robot.analysis.plotted.KINDS`."""
    shown: bool = True
    """True if the page begins with it; a reader can choose others."""

    def as_data(self) -> dict[str, Any]:
        """Return it for JSON, with values of four digits, None where nothing can be drawn."""
        series = []
        for one in self.series:
            known = np.isfinite(one.values) & ~(self.logarithmic & (one.values <= 0.0))
            pairs = zip(one.values, known, strict=True)
            values = [float(f"{value:.4g}") if is_known else None for value, is_known in pairs]
            series.append({**one._asdict(), "values": values})
        return {**self._asdict(), "series": series}


class Mark(NamedTuple):
    """A mark on the plots of a flight."""

    start: float
    """Start, s."""
    stop: float
    """End, s: equal to ``start`` for an instant, infinite for a permanent change."""
    text: str
    kind: str
    """``event``, ``fault``, ``law`` or ``shadow``."""

    def as_data(self) -> dict[str, Any]:
        """Return it for JSON, where no end is None."""
        return {**self._asdict(), "stop": self.stop if math.isfinite(self.stop) else None}


def flights_page(
    logs: Mapping[str, FlightLog],
    robots: Mapping[str, Robot],
    options: ViewOptions,
    advance: Callable[[int], Callable[[], None]],
) -> str:
    """Return the self-contained page of flights, at least one, and the robots that flew, by name.

    ``advance`` is called with the number of frames; what it returns after each frame.

    Raises:
        InputError: viser is not installed, or a flight has no state.
    """
    dark, colours = options.dark, palette(options.dark)
    flights = [
        ShownFlight(name, log, robots[name], colour)
        for (name, log), colour in zip(logs.items(), cycle(colours), strict=False)
    ]
    times = shown_times(list(logs.values()), options.rate)
    is_same_robot = len({(robot.name, robot.body_names) for robot in robots.values()}) == 1
    side_by_side = options.side_by_side or not is_same_robot
    scene = animate(flights, times, side_by_side, dark, advance)
    time, plots = flight_plots(logs, robots, colours, options.plots)
    notes = [note for log in logs.values() for note in actuator_notes(log, times)]
    if absent := set(options.plots) - {plot.kind for plot in plots}:
        notes.append(f"Not in the recording: {', '.join(sorted(absent))}.")
    in_orbit = [log for log in logs.values() if is_in_orbit(log)]
    has_sun = any(sun_direction(log) is not None for log in in_orbit)
    return render(
        options.title or ", ".join(logs),
        dark,
        time,
        plots,
        scene=scene,
        flights=[(flight, _description(flight)) for flight in flights],
        arrows=arrow_colours(has_sun, dark) if in_orbit else {},
        notes=list(dict.fromkeys(notes)),
        start=float(times[0]),
        marks=[mark.as_data() for mark in shared_marks(logs)],
    )


def render(title: str, dark: bool, time: Array, plots: Sequence[Plot], **content: Any) -> str:
    """Render the self-contained page of plots over ``time``, s, with the template's ``content``."""
    folder = files(__package__).joinpath("templates")
    parts = {"uplot": "uPlot.iife.min.js", "uplot_css": "uPlot.min.css"}
    parts |= {"css": "view.css", "script": "view.js"}
    data = {
        "plots": [plot.as_data() for plot in plots],
        "marks": content.pop("marks"),
        "time": np.round(time, 4).tolist(),
        "start": content.pop("start"),
        "dark": dark,
    }
    return template("space_robot.view", "view.html.j2").render(
        title=title,
        dark=dark,
        data=data,
        **{key: folder.joinpath(name).read_text("utf-8") for key, name in parts.items()},
        **content,
    )


def _description(flight: ShownFlight) -> str:
    log = flight.log
    law = in_words(as_data(laws_of(log), log.timebase)) or str(log.flight.get("controller", ""))
    case = log.flight.get("case")
    return ", ".join(filter(None, [law, flight.robot.name, f"case {case}" if case else ""]))


def shown_robot(log: FlightLog, name: str = "") -> Robot:
    """Return the robot of a flight: by ``name``, or from the bag if it is empty.

    Joints that are passive in the bag are so in a named robot, too, since a URDF has no springs.
    Of the bag's robot meshes are files that a bag names: only of a trusted one they are kept.

    Raises:
        InputError: the robot does not exist, is unknown, or has other joints than the bag.
    """
    if name:
        springs = dict.fromkeys(log.passive_names, Spring(0.0, 0.0))
        with suppress(InputError):  # unknown springs move nothing that is drawn
            own = flown_robot(log)
            springs |= zip(own.passive_names, own.springs, strict=True)
        robot = find_robot(robot_as_path(name)).with_springs(springs)
        check_joints(robot, log)
        return robot
    robot = flown_robot(log)
    if log.trusted:
        return robot
    return replace(robot, visuals=tuple(replace(shape, mesh="") for shape in robot.visuals))


def remarks_on(logs: Mapping[str, FlightLog], robots: Mapping[str, Robot]) -> list[str]:
    """Return problems of the recordings and the robots' shapes, one line each."""
    lines = [f"{name}: {text}" for name, log in logs.items() for text in log.defects]
    for name, robot in robots.items():
        lines += shown_shapes(robot).remarks
        if any(shape.shape == "mesh" and not shape.mesh for shape in robot.visuals):
            lines.append(f"{name}: mesh files that the bag names are drawn with --trust")
    return list(dict.fromkeys(lines))


def flight_plots(
    flights: Mapping[str, FlightLog],
    robots: Mapping[str, Robot],
    colours: Sequence[str],
    kinds: Sequence[str] = (),
) -> tuple[Array, list[Plot]]:
    """Return the common times, s, and the plots of some flights, ``kinds`` of which come first.

    For one flight each axis is drawn, for several the magnitude of each quantity; the colours are
    those of the axes, or of the flights. Without ``kinds`` the usual plots are shown.
    """
    start = min(float(log.time[0]) for log in flights.values())
    end = max(float(log.time[-1]) for log in flights.values())
    edges = np.linspace(start, end, STRETCHES + 1, dtype=np.float64)
    time = np.repeat(edges[:-1], 2)
    time[1::2] += 0.5 * (edges[1] - edges[0])
    plots: dict[tuple[str, str], Plot] = {}
    is_one = len(flights) == 1
    for (name, log), colour in zip(flights.items(), cycle(colours), strict=False):
        flight = AnalysedLog(log)
        flight.robot = robots[name]
        for kind, quantity in flown_quantities(flight):
            if is_one:
                series = list(_axis_series(log, quantity, colours, edges))
            else:
                series = [Series(name, colour, extremes(log, quantity.size, edges))]
            key = quantity.title, quantity.unit
            # of several flights sizes are drawn, which only errors have limits of
            sides = (1.0,) if quantity.is_error else (-1.0, 1.0) if is_one else ()
            plot = plots.get(key) or Plot(
                *key,
                [],
                quantity.is_error and not is_one,
                quantity.are_pulses and is_one,
                sorted({side * limit for limit in quantity.limits if limit for side in sides}),
                kind,
                kind in kinds if kinds else quantity.is_shown,
            )
            plots[key] = plot._replace(series=[*plot.series, *series])
    return time, list(plots.values())


def _axis_series(
    log: FlightLog, quantity: PlottedQuantity, colours: Sequence[str], edges: Array
) -> Iterator[Series]:
    for axis, (label, colour) in enumerate(zip(quantity.labels, cycle(colours), strict=False)):
        yield Series(label, colour, extremes(log, quantity.values[:, axis], edges))
        if quantity.wanted is not None:
            wanted = extremes(log, quantity.wanted[:, axis], edges)
            yield Series(f"{label}, desired", colour, wanted, True)


def extremes(log: FlightLog, values: Array, edges: Array) -> Array:
    """Return minimum and maximum (2 K,) of the values in each time interval, alternating.

    The values (N,) of a log's ticks, and the extremes, are NaN where unknown. The last interval
    between the edges (K + 1,), s, includes all later ticks.
    """
    starts = np.searchsorted(log.time, edges[:-1])
    lowest_and_highest = np.full((len(starts), 2), np.nan)
    inside = np.flatnonzero(np.diff(np.append(starts, len(values))) > 0)
    if len(inside):
        finite = np.where(np.isfinite(values), values, np.nan)
        for side, ufunc in enumerate((np.fmin, np.fmax)):
            lowest_and_highest[inside, side] = ufunc.reduceat(finite, starts[inside])
    return lowest_and_highest.ravel()


def flight_marks(log: FlightLog) -> list[Mark]:
    """Return the marks of a flight, by time; invalid entries of the bag are ignored."""
    period = log.timebase.period
    start = log.first_tick * period
    end = start + log.ticks * period
    marks = list(_fault_marks(log))
    with suppress(InputError):
        for event in flown_events(log):
            text = f"capture {event.target.name}" if isinstance(event, Capture) else "release"
            marks.append(Mark(event.time_s, event.time_s, text, "event"))
    for before, law in pairwise(laws_of(log)):
        time = law.tick * period
        marks.append(Mark(time, time, str(LawChange(before, law)), "law"))
    for begin, stop in shadow_intervals(log):
        marks.append(Mark(begin, stop, "in the Earth's shadow", "shadow"))
    return sorted(mark for mark in marks if mark.start < end and mark.stop >= start)


def _fault_marks(log: FlightLog) -> Iterator[Mark]:
    for text in log.flight.get("faults", ()):
        with suppress(InputError):
            fault = parse_fault(str(text), KINDS)
            stop = fault.stop_s if fault.kind.lasts else fault.start_s
            yield Mark(fault.start_s, stop, f"{fault.kind.name} {fault.argument}".strip(), "fault")


def shared_marks(flights: Mapping[str, FlightLog]) -> list[Mark]:
    """Return the marks of some flights, by time, with flight names unless all have the mark."""
    own_marks = {name: flight_marks(log) for name, log in flights.items()}
    shared = []
    for mark in sorted({mark for marks in own_marks.values() for mark in marks}):
        names = [name for name, marks in own_marks.items() if mark in marks]
        text = mark.text if len(names) == len(flights) else f"{', '.join(names)}: {mark.text}"
        shared.append(mark._replace(text=text))
    return shared
