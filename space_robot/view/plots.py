"""Plots and marks beside the scene, of one or several flights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import LawChange, laws_of
from space_robot_msgs_py.config.text import shortened
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.events import Capture
from space_robot_sim.faults.grammar import parse_fault

from ..analysis.analysed_log import AnalysedLog
from ..analysis.described import events_of
from ..analysis.plotted import PlottedQuantity, quantities_of
from ..scenario.faults import KINDS
from .orbit import shadow_intervals

Array = NDArray[np.float64]

STRETCHES = 400
"""Time intervals of a flight; minimum and maximum of each are drawn, so that chatter is visible."""
MOST_LETTERS = 40
"""Maximum length of a label, in characters."""


class Series(NamedTuple):
    """A line of a plot."""

    label: str
    colour: str
    values: Array
    """(K,) values."""
    is_wanted: bool = False
    """True for desired values."""


class Plot(NamedTuple):
    """A plot over time."""

    title: str
    unit: str
    time: Array
    """(K,) time, s."""
    series: Sequence[Series]
    is_logarithmic: bool = False
    are_pulses: bool = False
    """True if each series has a separate row, for values from 0 to 1."""
    limits: Sequence[float] = ()
    """Values at which a line goes across."""
    kind: str = ""
    """One of `space_robot.analysis.plotted.KINDS`."""
    is_shown: bool = True
    """True if the page begins with it; a reader can choose others."""


def plots_of(
    flights: Mapping[str, FlightLog],
    robots: Mapping[str, Robot],
    colours: Sequence[str],
    kinds: Sequence[str] = (),
) -> list[Plot]:
    """Return the plots of some flights.

    For one flight each axis is drawn, for several the magnitude of each quantity.

    Args:
        flights: by name.
        robots: that flew, by the same names.
        colours: of the flights; for one flight those of the axes.
        kinds: of the plots that are shown first; empty: the usual ones.
    """
    logs = list(flights.values())
    edges = np.linspace(
        min(float(log.time[0]) for log in logs),
        max(float(log.time[-1]) for log in logs),
        STRETCHES + 1,
        dtype=np.float64,
    )
    time = np.repeat(edges[:-1], 2)
    time[1::2] += 0.5 * (edges[1] - edges[0])
    plots: dict[tuple[str, str], Plot] = {}
    is_one = len(flights) == 1
    for (name, log), colour in zip(flights.items(), cycle(colours), strict=False):
        flight = AnalysedLog(log)
        flight.robot = robots[name]
        for kind, quantity in quantities_of(flight):
            if is_one:
                series = _each_axis(log, quantity, colours, edges)
            else:
                label = shortened(name, MOST_LETTERS)
                series = [Series(label, colour, extremes(log, quantity.size, edges))]
            key = quantity.title, quantity.unit
            # of several flights sizes are drawn, which only errors have limits of
            sides = (1.0,) if quantity.is_error else (-1.0, 1.0) if is_one else ()
            plot = plots.get(key) or Plot(
                *key,
                time,
                [],
                quantity.is_error and not is_one,
                quantity.are_pulses and is_one,
                sorted({side * limit for limit in quantity.limits if limit for side in sides}),
                kind,
                kind in kinds if kinds else quantity.is_shown,
            )
            plots[key] = plot._replace(series=[*plot.series, *series])
    return list(plots.values())


def _each_axis(
    log: FlightLog, quantity: PlottedQuantity, colours: Sequence[str], edges: Array
) -> list[Series]:
    series = []
    for axis, (label, colour) in enumerate(zip(quantity.labels, cycle(colours), strict=False)):
        text = shortened(label, MOST_LETTERS)
        series.append(Series(text, colour, extremes(log, quantity.values[:, axis], edges)))
        if quantity.wanted is not None:
            wanted = extremes(log, quantity.wanted[:, axis], edges)
            series.append(Series(f"{text}, desired", colour, wanted, is_wanted=True))
    return series


def extremes(log: FlightLog, values: Array, edges: Array) -> Array:
    """Return minimum and maximum of the values in each time interval, alternating.

    Args:
        log: with the ticks of the values.
        values: (N,), NaN where unknown.
        edges: (K + 1,) of the intervals, s; the last one includes all later ticks.

    Returns:
        (2 K,), NaN for intervals without a known value.
    """
    starts = np.searchsorted(log.time, edges[:-1])
    lowest_and_highest = np.full((len(starts), 2), np.nan)
    inside = np.flatnonzero(np.diff(np.append(starts, len(values))) > 0)
    if len(inside):
        finite = np.where(np.isfinite(values), values, np.nan)
        lowest_and_highest[inside] = np.column_stack(
            [ufunc.reduceat(finite, starts[inside]) for ufunc in (np.fmin, np.fmax)]
        )
    return lowest_and_highest.ravel()


class Mark(NamedTuple):
    """A mark on the plots of a flight."""

    start: float
    """Start, s."""
    stop: float
    """End, s: equal to ``start`` for an instant, infinite for a permanent change."""
    text: str
    kind: str
    """``event``, ``fault``, ``law`` or ``shadow``."""


def marks_of(log: FlightLog) -> list[Mark]:
    """Return the marks of a flight, by time; invalid entries of the bag are ignored."""
    period = log.timebase.period
    start = log.first_tick * period
    end = start + log.ticks * period
    marks = [*_events(log), *_faults(log)]
    for before, law in pairwise(laws_of(log)):
        time = law.tick * period
        marks.append(Mark(time, time, str(LawChange(before, law)), "law"))
    for begin, stop in shadow_intervals(log):
        marks.append(Mark(begin, stop, "in the Earth's shadow", "shadow"))
    return sorted(mark for mark in marks if mark.start < end and mark.stop >= start)


def shared_marks(flights: Mapping[str, FlightLog]) -> list[Mark]:
    """Return the marks of some flights, by time, with flight names unless all have the mark."""
    own_marks = {name: marks_of(log) for name, log in flights.items()}
    shared = []
    for mark in sorted({mark for marks in own_marks.values() for mark in marks}):
        names = [name for name, marks in own_marks.items() if mark in marks]
        text = mark.text if len(names) == len(flights) else f"{', '.join(names)}: {mark.text}"
        shared.append(mark._replace(text=text))
    return shared


def _events(log: FlightLog) -> list[Mark]:
    try:
        events = events_of(log)
    except InputError:
        return []
    return [
        Mark(
            event.time_s,
            event.time_s,
            f"capture {event.target.name}" if isinstance(event, Capture) else "release",
            "event",
        )
        for event in events
    ]


def _faults(log: FlightLog) -> list[Mark]:
    marks = []
    for text in log.flight.get("faults", ()):
        try:
            fault = parse_fault(str(text), KINDS)
        except InputError:
            continue
        stop = fault.stop_s if fault.kind.lasts else fault.start_s
        text = f"{fault.kind.name} {fault.argument}".strip()
        marks.append(Mark(fault.start_s, stop, text, "fault"))
    return marks
