"""The plots beside the scene, of one flight or of several together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.text import shortened

from ..analysis.plot_series import tick_times
from .quantities import PlottedQuantity, quantities_of

Array = NDArray[np.float64]

STRETCHES = 600
"""Of a flight; of each the lowest and the highest value is drawn, so that no chatter is lost."""
MOST_LETTERS = 40
"""Of a label."""


class Series(NamedTuple):
    """A line of a plot."""

    label: str
    colour: str
    values: Array
    """(K,)"""


class Plot(NamedTuple):
    """A plot over time."""

    title: str
    unit: str
    time: Array
    """(K,) s."""
    series: Sequence[Series]
    is_logarithmic: bool = False
    are_pulses: bool = False
    """True if each series has a row of its own, for values from 0 to 1."""


def plots_of(
    flights: Mapping[str, FlightLog], robots: Mapping[str, Robot], colours: Sequence[str]
) -> list[Plot]:
    """Return the plots of some flights.

    Of one flight each axis is drawn, of several the size of each quantity.

    Args:
        flights: by name.
        robots: that flew, by the same names.
        colours: of the flights; of one flight those of the axes.
    """
    logs = list(flights.values())
    edges = np.linspace(
        min(float(tick_times(log)[0]) for log in logs),
        max(float(tick_times(log)[-1]) for log in logs),
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
    """Return the lowest and the highest of the values in each stretch of time, in turn.

    Args:
        log: whose ticks the values are of.
        values: (N,), NaN where not known.
        edges: (K + 1,) s, of the stretches; the last one has all later ticks, too.

    Returns:
        (2 K,), NaN of stretches without a known value.
    """
    starts = np.searchsorted(tick_times(log), edges[:-1])
    lowest_and_highest = np.full((len(starts), 2), np.nan)
    inside = np.flatnonzero(np.diff(np.append(starts, len(values))) > 0)
    if len(inside):
        finite = np.where(np.isfinite(values), values, np.nan)
        lowest_and_highest[inside] = np.column_stack(
            [ufunc.reduceat(finite, starts[inside]) for ufunc in (np.fmin, np.fmax)]
        )
    return lowest_and_highest.ravel()
