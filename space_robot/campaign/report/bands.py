"""Percentile bands over time of a campaign's errors and torques, for each law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ...analysis.figures.style import COLOURS, GREY, LineStyle, grid, house_style, page, plain
from ...analysis.measure import column_label, column_unit
from ..study import short_names
from ..verdicts.values import GridPoint, laws_of, of_law
from .axes import law_legend, number_log_axis

if TYPE_CHECKING:
    from pandas import DataFrame

Array = NDArray[np.float64]

SHARES = (0.05, 0.5, 0.95)
MOST_PANELS = 12
"""Maximum number of grid points that are drawn."""
DECADES = 2.0
"""Decades above the largest 95 % curve at which the worst flight's curve is cut off."""


def series_of(table: DataFrame) -> list[str]:
    """Return the names of the series that have bands."""
    names = [c.removeprefix("band.") for c in map(str, table) if c.startswith("band.")]
    names = [name for name in names if table[f"band.{name}"].notna().any()]
    return [name for name in names if name != "attitude" or "attitude_angle" not in names]


def bands(rows: DataFrame, series: str) -> Array:
    """Compute the quantiles `SHARES` and the maximum of a series at every time, (4, bins).

    A failed flight counts as infinite from its end on; the maximum is that of the other flights.

    Args:
        rows: of one law, at one point of the grid.
        series: a name of `series_of`.
    """
    curves = [np.asarray(b, np.float64) for b in rows[f"band.{series}"] if np.ndim(b)]
    curves += [np.empty(0)] * (len(rows) - len(curves))
    bins = max(map(len, curves))
    table = np.full((len(curves), bins), np.inf)
    for row, values in zip(table, curves, strict=True):
        row[: len(values)] = values
    table[np.isnan(table)] = np.inf
    quantiles = np.quantile(table, SHARES, axis=0, method="inverted_cdf")
    largest = np.max(table, axis=0, where=np.isfinite(table), initial=0.0)
    found_bands: Array = np.vstack([quantiles, largest])
    return found_bands


@house_style()
def band_figure(
    parts: Sequence[GridPoint], laws: Sequence[str], series: str, time_s: float
) -> Figure:
    """Draw a series over time: one panel per law, or per grid point if there is a grid.

    Args:
        parts: points of the grid; one if there is no grid.
        laws: of the campaign.
        series: a name of `series_of`.
        time_s: duration of all bins together, s.
    """
    shown = parts[:MOST_PANELS]
    curves = {
        (number, law): bands(of_law(part.table, law), series)
        for number, part in enumerate(shown)
        for law in laws_of(part.table)
    }
    curves = {key: value for key, value in curves.items() if value.size}
    if not curves:
        return page(12.0, "No flight has a series over time.")
    per_law = len(shown) == 1
    titles = list(short_names(laws).values()) if per_law else [part.point for part in shown]
    columns = columns_of(len(titles))
    figure = page(16.0 + 42.0 * -(-len(titles) // columns))
    panels = grid(figure, len(titles), columns)
    for (number, law), values in curves.items():
        index = laws.index(law)
        axes = panels[index if per_law else number]
        edges = np.linspace(0.0, time_s, values.shape[1] + 1)
        time, drawn = 0.5 * (edges[1:] + edges[:-1]), np.where(np.isinf(values), np.nan, values)
        if per_law:
            _draw_band(axes, time, drawn, COLOURS[2])
        else:
            look = LineStyle.of(index)
            axes.plot(time, drawn[1], color=look.colour, linestyle=look.dashes)
            axes.plot(time, drawn[2], color=look.colour, linestyle=look.dashes, linewidth=0.5)
    unit = column_unit(series).strip("-")
    for axes, title in zip(panels, titles, strict=True):
        axes.set_title(plain(title))
    for number in range(0, len(panels), columns):
        panels[number].set_ylabel(
            f"{column_label(series)} ({unit})" if unit else f"{column_label(series)} error"
        )
    for axes in panels[-columns:]:
        axes.set_xlabel("time (s)")
    _scale(panels[0], list(curves.values()))
    if per_law:
        _name_bands(figure)
    else:
        law_legend(figure, laws)
    return figure


def columns_of(panels: int) -> int:
    """Return the number of columns for a number of panels."""
    return 2 if panels in (2, 4) else min(3, panels)


def _draw_band(axes: Axes, time: Array, drawn: Array, colour: str) -> None:
    low, middle, high, worst = drawn
    # where more than 5 % of the flights have failed, the band is open at the top
    top = np.where(np.isnan(high), np.nanmax(drawn, initial=0.0) * 1e6, high)
    axes.fill_between(time, low, top, color=colour, alpha=0.25, linewidth=0.0)
    axes.plot(time, middle, color=colour)
    axes.plot(time, worst, color=GREY, linewidth=0.6)


def _name_bands(figure: Figure) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    colour = COLOURS[2]
    figure.legend(
        handles=[
            Line2D([], [], color=colour, label="median"),
            Patch(color=colour, alpha=0.25, linewidth=0.0, label="5 % to 95 %"),
            Line2D([], [], color=GREY, linewidth=0.6, label="worst of those still flying"),
        ],
        loc="outside upper left",
        ncols=3,
    )


def _scale(axes: Axes, curves: Sequence[Array]) -> None:
    """Make the common vertical axis logarithmic, starting at the minimum of the 5 % curves."""
    axes.set_yscale("log", nonpositive="mask")
    low, high, worst = (
        np.concatenate([v[k][np.isfinite(v[k]) & (v[k] > 0.0)] for v in curves]) for k in (0, 2, 3)
    )
    usual = high if len(high) else worst
    if not len(low) or not len(usual):
        return
    top = min(float(worst.max()), float(usual.max()) * 10.0**DECADES)
    axes.set_ylim(0.5 * float(np.percentile(low, 2.0)), 2.0 * top)
    number_log_axis(axes, "y")
