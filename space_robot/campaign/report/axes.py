"""Tick labels of logarithmic axes, and the legend of the laws."""

from __future__ import annotations

from collections.abc import Sequence
from math import log10

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

from ...analysis.figures.style import legend_above
from ..study import short_names

NARROW = 1.6
"""Axes with fewer decades have labels between powers of ten, too."""


def number_log_axis(axes: Axes, name: str) -> None:
    """Label the logarithmic axis ``x`` or ``y`` without overlaps."""
    axis = {"x": axes.xaxis, "y": axes.yaxis}[name]
    low, high = axis.get_view_interval()
    if 0.0 < low < high and log10(high / low) < NARROW:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(LogFormatterSciNotation(minor_thresholds=(10.0, 10.0)))
    axis.set_minor_formatter(NullFormatter())


def law_legend(figure: Figure, laws: Sequence[str], dashed: bool = True) -> None:
    """Draw a legend of the laws above a figure."""
    legend_above(figure, list(short_names(laws).values()), dashed=dashed)
