"""Spectrum of the torques' ripple of several laws."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..measure import column_label, column_unit
from .flight_curves import FlightCurves
from .style import LineStyle, house_style, legend_above, page, scattered

Array = NDArray[np.float64]


@house_style()
def ripple(flights: Mapping[str, FlightCurves]) -> Figure:
    """Draw the spectral density of the ripple, one panel per group of axes (mean of the axes).

    Args:
        flights: by name.
    """
    known = {name: s.ripple for name, s in flights.items() if s.ripple is not None}
    if not known:
        return page(12.0, "None of these flights has a known robot and is long enough for ripple.")
    columns = [flights[name].torque_axes for name in known]
    groups = {key: axes for column in columns for key, axes in column.items()}
    figure = page(18.0 + 55.0 * len(groups))
    panels = figure.subplots(len(groups), 1, sharex=True, squeeze=False)[:, 0]
    names = list(flights)
    for panel, key in zip(panels, groups, strict=True):
        for (name, spectrum), column in zip(known.items(), columns, strict=True):
            if key not in column:
                continue
            frequency = spectrum.frequency
            density = spectrum.group(column[key]) / (frequency[1] - frequency[0])
            if not density.any():
                continue
            look = LineStyle.of(names.index(name))
            panel.plot(
                frequency,
                np.where(density > 0.0, density, np.nan),
                color=look.colour,
                linestyle=look.dashes,
                marker=look.marker,
                linewidth=0.7,
                markevery=_marks(frequency, names.index(name), len(names)),
            )
        squared = "N²" if column_unit(key) == "N" else "(N m)²"
        panel.set(xscale="log", yscale="log", ylabel=f"PSD of {column_label(key)} ({squared}/Hz)")
    panels[-1].set_xlabel("frequency (Hz)")
    panels[-1].xaxis.set_major_formatter("{x:g}")
    figure.align_ylabels()
    legend_above(figure, names, dashed=True)
    return figure


def _marks(frequency: Array, index: int, count: int) -> list[int]:
    """Return the indices of the frequencies to mark, evenly along the logarithmic axis."""
    even = np.geomspace(frequency[0], frequency[-1], 1000)
    marks: list[int] = np.searchsorted(frequency, even[scattered(1000, index, count)]).tolist()
    return marks
