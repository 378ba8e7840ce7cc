"""Numbers along logarithmic axes."""

from __future__ import annotations

from math import log10

from matplotlib.axes import Axes
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

NARROW = 1.6
"""Decades below which numbers stand between powers of ten, too."""


def number_log_axis(axes: Axes, name: str) -> None:
    """Put numbers along the logarithmic axis ``x`` or ``y`` that do not run into one another."""
    axis = {"x": axes.xaxis, "y": axes.yaxis}[name]
    low, high = axis.get_view_interval()
    if 0.0 < low < high and log10(high / low) < NARROW:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(LogFormatterSciNotation(minor_thresholds=(10.0, 10.0)))
    axis.set_minor_formatter(NullFormatter())
