"""Plots beside the scene, of one or several flights."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.text import shortened

from .plotted_quantity import PlottedQuantity
from .quantities import quantities_of

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
    kind: str = ""
    """One of `PLOT_KINDS`."""
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
        kinds: of the plots that are shown first, see `PLOT_KINDS`; empty: the usual ones.
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
    for (name, log), colour in zip(flights.items(), cycle(colours), strict=False):
        for quantity in quantities_of(log, robots[name]):
            is_one = len(flights) == 1
            series = (
                _of_axes(log, quantity, colours, edges)
                if is_one
                else [_of_size(log, name, colour, quantity, edges)]
            )
            key = quantity.title, quantity.unit
            before = plots[key].series if key in plots else []
            plots[key] = Plot(
                *key,
                time,
                [*before, *series],
                quantity.is_error and not is_one,
                quantity.are_pulses and is_one,
                quantity.kind,
                quantity.kind in kinds if kinds else quantity.is_shown,
            )
    return list(plots.values())


def _of_axes(
    log: FlightLog, quantity: PlottedQuantity, colours: Sequence[str], edges: Array
) -> list[Series]:
    return [
        Series(shortened(label, MOST_LETTERS), colour, extremes(log, axis, edges))
        for axis, label, colour in zip(
            quantity.values.T, quantity.labels, cycle(colours), strict=False
        )
    ]


def _of_size(
    log: FlightLog, name: str, colour: str, quantity: PlottedQuantity, edges: Array
) -> Series:
    size = np.linalg.norm(quantity.values, axis=1)
    return Series(shortened(name, MOST_LETTERS), colour, extremes(log, size, edges))


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
