"""One short stretch of several flights, a panel each, all on one scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from statistics import median_low
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from .base_torque import BaseTorque
from .lines import draw_lines
from .quantity import Quantity
from .scale import draw_scales
from .style import GREY, LEFT, PAGE_WIDTH, RIGHT, TIME_AXIS, panel

Array = NDArray[np.float64]

LOUD = 2.0
"""A flight that swings over so many times the range of the middle one does not set the scale."""

_COLUMN_GAP, _ROW_GAP, _NAME = 10.0, 4.0, 5.0
"""mm between panels, and for the flight's name above one."""


class Stretch(NamedTuple):
    """What the panels show of each flight."""

    name: str
    axes: slice
    """Of the base's torque."""
    moment: float
    """s, zero of the time axis."""
    begin: float
    """s from the moment."""
    end: float
    """s from the moment."""

    def of(self, flight: BaseTorque) -> tuple[Array, Array]:
        """Time from the moment, s, and torque, N m; empty if the flight ended before."""
        time = flight.time - self.moment
        shown = (time > self.begin - 1e-9) & (time < self.end + 1e-9)
        return time[shown], flight.torque[shown, self.axes]


def grid_height(count: int, columns: int, height: float) -> float:
    """Mm that ``count`` panels of ``height`` take, with names and time axis."""
    rows = -(-count // columns)
    return rows * (_NAME + height) + (rows - 1) * _ROW_GAP + TIME_AXIS


def draw_side_by_side(
    figure: Figure,
    top: float,
    height: float,
    columns: int,
    flights: Mapping[str, BaseTorque],
    stretch: Stretch,
    *,
    steps: bool = False,
) -> list[Axes]:
    """Draw the panels from ``top`` down, rows of ``columns`` of ``height`` mm."""
    width = (PAGE_WIDTH - LEFT - RIGHT - _COLUMN_GAP * (columns - 1)) / columns
    curves = {name: stretch.of(flight) for name, flight in flights.items()}
    low, high = common_limits([torque for _, torque in curves.values()])
    quantity = Quantity.of(np.array([low, high]), stretch.name, "N m")
    panels = []
    for number, (name, (time, torque)) in enumerate(curves.items()):
        row, column = divmod(number, columns)
        place = (
            LEFT + column * (width + _COLUMN_GAP),
            top + _NAME + row * (_NAME + height + _ROW_GAP),
        )
        axes = panel(figure, *place, width, height)
        if np.isfinite(torque).any():
            marks = None if torque.shape[1] > 1 else np.empty(0, np.intp)
            draw_lines(axes, 1e3 * time, torque, quantity, marks=marks, steps=steps)
        else:
            axes.text(0.03, 0.5, f"ended at {flights[name].end:g} s", color=GREY,
                      transform=axes.transAxes)  # fmt: skip
        axes.set_title(name + _cut(torque, low, high), loc="left")
        axes.set_ylabel(quantity.label if column == 0 else "")
        axes.set_xlim(1e3 * stretch.begin, 1e3 * stretch.end)
        axes.set_ylim(*quantity.scaled(np.array([low, high])))
        lowest = number + columns >= len(curves)
        axes.set_xlabel(f"time from {stretch.moment:g} s (ms)" if lowest else "")
        draw_scales(axes, x_numbers=lowest, y_numbers=column == 0)
        panels.append(axes)
    return panels


def common_limits(torques: Sequence[Array]) -> tuple[float, float]:
    """Limits that hold all but the loud ones of ``torques``, with a margin, N m."""
    known = [torque[np.isfinite(torque)] for torque in torques]
    known = [torque for torque in known if len(torque)]
    if not known:
        return -1.0, 1.0
    ranges = [float(np.ptp(torque)) for torque in known]
    usual = median_low(ranges)
    quiet = [t for t, range_ in zip(known, ranges, strict=True) if range_ <= LOUD * usual]
    low, high = min(float(t.min()) for t in quiet), max(float(t.max()) for t in quiet)
    margin = 0.05 * (high - low) or max(0.05 * abs(high), 0.01)
    return low - margin, high + margin


def _cut(torque: Array, low: float, high: float) -> str:
    """What the heading adds for a flight that goes beyond the limits."""
    known = torque[np.isfinite(torque)]
    if not len(known) or (known.min() >= low and known.max() <= high):
        return ""
    return f", cut: {known.min():.2g} … {known.max():.2g}"
