"""Drawing the columns of an array as lines, each told from the others."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog

from .envelope import envelope
from .quantity import Quantity
from .style import GREY, Look

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

MARKS = 4
"""Markers a line."""


def draw_lines(
    axes: Axes,
    time: Array,
    values: Array,
    quantity: Quantity,
    *,
    marks: Indices | None = None,
    dashed: bool = False,
    steps: bool = False,
) -> None:
    """Draw the columns of ``values`` and label the axis.

    Args:
        axes: where to.
        time: (N,) in the unit of the horizontal axis.
        values: (N, m), one line a column; what is not finite is left out.
        quantity: what they are.
        marks: samples with a marker; by default some of each line, where no other has one.
        dashed: tell the lines apart by dashes too; chatter would make a muddle of them.
        steps: draw each value as having held since the one before it.
    """
    axes.set_ylabel(quantity.label)
    lines = [(column, envelope(column)) for column in values.T]
    # The wildest line lies at the back, for it would hide the others.
    roughness = [
        np.nansum(np.abs(np.diff(quantity.scaled(column[kept])))) for column, kept in lines
    ]
    for depth, index in enumerate(np.argsort(roughness)[::-1].tolist()):
        look, (column, kept) = Look.of(index), lines[index]
        marked = scattered_marks(len(time), index, len(lines)) if marks is None else marks
        drawn = np.union1d(kept, marked)
        axes.plot(
            time[drawn], quantity.scaled(column[drawn]),
            color=look.colour, linestyle=look.dashes if dashed else "-",
            marker=look.marker, markevery=np.searchsorted(drawn, marked).tolist(),
            drawstyle="steps-pre" if steps else "default", zorder=2.0 + 0.01 * depth,
        )  # fmt: skip


def tick_times(log: FlightLog) -> Array:
    """(N,) s, of the ticks of a log."""
    ticks = log.first_tick + np.arange(log.ticks, dtype=np.float64)
    return ticks * log.timebase.period


def scattered_marks(samples: int, index: int, count: int) -> Indices:
    """Samples of the line ``index`` of ``count`` to mark: never where another is marked."""
    places = (np.arange(MARKS) + (index + 0.5) / count) / MARKS
    return np.unique((places * samples).astype(np.intp))


def mark_moments(axes: Axes, moments: Array) -> None:
    """Dotted upright lines at ``moments``, in the unit of the horizontal axis."""
    for moment in moments:
        axes.axvline(moment, color=GREY, linewidth=0.8, linestyle=":", zorder=1.5)
