"""The figures of a report with their captions."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import log10
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, NullFormatter

from space_robot_model.elementary.matrices import Array

from ...analysis.figures.figure_set import Drawing
from ...analysis.figures.style import (
    COLOURS,
    GREY,
    LineStyle,
    grid,
    house_style,
    legend_above,
    page,
    plain,
)
from ...analysis.measure import column_definition, column_label
from ..study import short_names
from ..verdicts.laws import Estimate
from ..verdicts.rows import GridPoint, has_values, is_complete, law_rows, laws_in, penalised
from .findings import Findings, Quantity

if TYPE_CHECKING:
    from pandas import DataFrame

SHARES = (0.05, 0.5, 0.95)
MOST_PANELS = 12
"""Maximum number of grid points that are drawn."""
MOST_INFLUENCES = 4
"""Maximum number of grid points with a figure of influences; the table has all."""
MOST_VARIABLES = 10
"""Maximum number of variables drawn: the strongest over all laws."""
MOST_LAWS = 5
"""Maximum number of laws in a figure of influences, one panel each."""
LONGEST = 34
"""Maximum length of a variable's name, in characters."""
STEPS, TAIL = 200, 60
"""Points of a curve; the `TAIL` runs at either end are drawn individually."""
DECADES = 2.0
"""Decades above the largest 95 % curve at which the worst flight's curve is cut off."""
NARROW = 1.6
"""Axes with fewer decades have labels between powers of ten, too."""


def drawings(findings: Findings) -> dict[str, list[Drawing]]:
    """Return all figures for which there are rows, not drawn yet, by key of their `Section`."""
    table, points, laws = findings.table, findings.points, findings.laws
    by_section: dict[str, list[Drawing]] = defaultdict(list)
    known = [q for q in findings.metrics if has_values(table, q.column)]
    several = len(points) > 1
    if several and known:
        caption = "Medians, with bars from 5 % to 95 % of the runs, at every point of the grid"
        draw = partial(grid_figure, points, laws, known, findings.grid)
        by_section["laws"].append(Drawing(caption, draw))
    shown = f" (the first {MOST_PANELS} points of the grid)" if len(points) > MOST_PANELS else ""
    lines = "median (thick) and 95 % (thin) of the runs" if several else "percentiles of the runs"
    ended = table["ended_at_s"][is_complete(table)].max()  # NaN if no flight is complete
    for name in series_in(table):
        caption = f"{column_label(name)} over time: {lines} at each time{shown}"
        draw = partial(band_figure, points, laws, name, np.nan_to_num(ended))
        by_section["bands"].append(Drawing(caption, draw))
    required = [q for q in findings.required if has_values(table, q.column)]
    for quantity in [*required, *known]:
        name = f" ({quantity.name})" if quantity.requirement else ""
        caption = f"Distribution of {quantity.heading}{name} over the runs{shown}"
        draw = partial(distribution_figure, points, laws, quantity)
        by_section["distributions"].append(Drawing(caption, draw))
    for quantity in findings.judged:
        for point in points[:MOST_INFLUENCES]:
            matching = {
                result.law: {i.variable: i for i in result.influences}
                for p, q, result in findings.sensitivities
                if (p, q) == (point, quantity)
            }
            caption = f"Influence on {quantity.heading}{point.point and f', {point.point}'}"
            if matching:
                draw = partial(influence_figure, matching)
                by_section["influences"].append(Drawing(caption, draw))
    for metric in dict.fromkeys(s.metric for s in findings.sobol):
        indices = {
            s.law: {i.variable: i for i in s.indices} for s in findings.sobol if s.metric == metric
        }
        draw = partial(sobol_figure, indices)
        by_section["influences"].append(Drawing(f"Sobol indices of {metric}", draw))
    return by_section


def summary_figure(findings: Findings) -> Figure | None:
    """Draw the most important figure: the first of the laws, or of the distributions."""
    by_section = drawings(findings)
    chosen = by_section["laws"] or by_section["distributions"]
    return chosen[0].draw() if chosen else None


@house_style()
def grid_figure(
    points: Sequence[GridPoint],
    laws: Sequence[str],
    metrics: Sequence[Quantity],
    names: Sequence[str],
) -> Figure:
    """Draw every metric at every point of a grid: medians, with bars from 5 % to 95 % of the runs.

    There is a panel per metric; ``names`` are those of the grid's variables.
    """
    figure = page(24.0 + 42.0 * len(metrics))
    panels = figure.subplots(len(metrics), 1, sharex=True, squeeze=False)[:, 0]
    for axes, metric in zip(panels, metrics, strict=True):
        for place, point in enumerate(points):
            for law in laws_in(point.table):
                index = laws.index(law)
                shift = 0.7 / len(laws) * (index - 0.5 * (len(laws) - 1))
                values = penalised(law_rows(point.table, law), metric.column)
                low, middle, high = np.quantile(values, SHARES, method="inverted_cdf").tolist()
                if not np.isfinite(middle):
                    continue  # most of them failed
                top = high if np.isfinite(high) else float(values[np.isfinite(values)].max())
                estimate = Estimate(middle, low, top)
                _draw_error_bar(axes, place + shift, estimate, LineStyle.of(index), linewidth=0.8)
        axes.set_yscale("log")
        _number_log_axis(axes, "y")
        axes.set_ylabel(metric.label)
    ticks = ["\n".join(map(plain, point.values)) for point in points]
    panels[-1].set_xticks(range(len(points)), ticks)
    panels[-1].set_xlim(-0.5, len(points) - 0.5)
    panels[-1].set_xlabel(", ".join(plain(name.removeprefix("scenario.")) for name in names))
    figure.align_ylabels()
    legend_above(figure, list(short_names(laws).values()), dashed=False)
    return figure


def series_in(table: DataFrame) -> list[str]:
    """Return the names of the series that have bands."""
    names = [c.removeprefix("band.") for c in map(str, table) if c.startswith("band.")]
    names = [name for name in names if table[f"band.{name}"].notna().any()]
    return [name for name in names if name != "attitude" or "attitude_angle" not in names]


def bands(rows: DataFrame, series: str) -> Array:
    """Compute the quantiles `SHARES` and the maximum of a series at every time, (4, bins).

    A failed flight counts as infinite from its end on; the maximum is that of the other flights.
    The rows are those of one law at one point of the grid.
    """
    curves = [np.asarray(b, np.float64) for b in rows[f"band.{series}"] if np.ndim(b)]
    table = np.full((len(rows), max(map(len, curves), default=0)), np.inf)
    for row, values in zip(table, curves, strict=False):  # those without a curve are last
        row[: len(values)] = values
    table[np.isnan(table)] = np.inf
    quantiles = np.quantile(table, SHARES, axis=0, method="inverted_cdf")
    largest = np.max(table, axis=0, where=np.isfinite(table), initial=0.0)
    curves_by_share: Array = np.vstack([quantiles, largest])
    return curves_by_share


@house_style()
def band_figure(
    points: Sequence[GridPoint], laws: Sequence[str], series: str, time_s: float
) -> Figure:
    """Draw a series over the time of all bins: a panel per law, or per grid point of several."""
    shown, per_law = points[:MOST_PANELS], len(points) == 1
    curves = {
        (number, law): values
        for number, point in enumerate(shown)
        for law in laws_in(point.table)
        if (values := bands(law_rows(point.table, law), series)).size
    }
    if not curves:
        return page(12.0, "No flight has a series over time.")
    titles = list(short_names(laws).values()) if per_law else [point.point for point in shown]
    unit = column_definition(series).unit.strip("-")
    label = f"{column_label(series)} ({unit})" if unit else f"{column_label(series)} error"
    figure, panels = _panels(titles, "time (s)", label)
    for (number, law), values in curves.items():
        index = laws.index(law)
        edges = np.linspace(0.0, time_s, values.shape[1] + 1)
        time, drawn = 0.5 * (edges[1:] + edges[:-1]), np.where(np.isinf(values), np.nan, values)
        low, middle, high, worst = drawn
        axes, style = panels[index if per_law else number], LineStyle.of(index)
        if per_law:
            # where more than 5 % of the flights have failed, the band is open at the top
            top = np.where(np.isnan(high), np.nanmax(drawn, initial=0.0) * 1e6, high)
            axes.fill_between(time, low, top, color=COLOURS[2], alpha=0.25, linewidth=0.0)
            axes.plot(time, middle, color=COLOURS[2])
            axes.plot(time, worst, color=GREY, linewidth=0.6)
        else:
            axes.plot(time, middle, color=style.colour, linestyle=style.dashes)
            axes.plot(time, high, color=style.colour, linestyle=style.dashes, linewidth=0.5)
    _scale(panels[0], list(curves.values()))
    if per_law:
        handles = [
            Line2D([], [], color=COLOURS[2], label="median"),
            Patch(color=COLOURS[2], alpha=0.25, linewidth=0.0, label="5 % to 95 %"),
            Line2D([], [], color=GREY, linewidth=0.6, label="worst of those still flying"),
        ]
        figure.legend(handles=handles, loc="outside upper left", ncols=3)
    else:
        legend_above(figure, list(short_names(laws).values()), dashed=True)
    return figure


def _panels(titles: Sequence[str], xlabel: str, ylabel: str) -> tuple[Figure, list[Axes]]:
    count = len(titles)
    columns = 2 if count in (2, 4) else min(3, count)
    figure = page(16.0 + 42.0 * -(-count // columns))
    panels = grid(figure, count, columns)
    for number, (axes, title) in enumerate(zip(panels, titles, strict=True)):
        axes.set_title(plain(title))
        if number % columns == 0:
            axes.set_ylabel(ylabel)
        if number >= count - columns:
            axes.set_xlabel(xlabel)
    return figure, panels


def _scale(axes: Axes, curves: Sequence[Array]) -> None:
    # the common vertical axis is logarithmic, and starts at the minimum of the 5 % curves
    axes.set_yscale("log", nonpositive="mask")
    low, high, worst = (
        np.concatenate([v[k][np.isfinite(v[k]) & (v[k] > 0.0)] for v in curves]) for k in (0, 2, 3)
    )
    usual = high if len(high) else worst
    if not len(low) or not len(usual):
        return
    top = min(float(worst.max()), float(usual.max()) * 10.0**DECADES)
    axes.set_ylim(0.5 * float(np.percentile(low, 2.0)), 2.0 * top)
    _number_log_axis(axes, "y")


def _number_log_axis(axes: Axes, name: str) -> None:
    axis = {"x": axes.xaxis, "y": axes.yaxis}[name]
    low, high = axis.get_view_interval()
    if 0.0 < low < high and log10(high / low) < NARROW:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(LogFormatterSciNotation(minor_thresholds=(10.0, 10.0)))
    axis.set_minor_formatter(NullFormatter())


@house_style()
def distribution_figure(
    points: Sequence[GridPoint], laws: Sequence[str], quantity: Quantity
) -> Figure:
    """Draw the cumulative distribution with its limit, and without a grid also its complement."""
    if len(points) > 1:
        shown = points[:MOST_PANELS]
        titles = [point.point for point in shown]
        figure, panels = _panels(titles, quantity.label, "share of the runs")
        for axes, point in zip(panels, shown, strict=True):
            _draw_distributions(axes, point.table, laws, quantity)
    else:
        figure, table = page(72.0), points[0].table
        panels = list(figure.subplots(1, 2, sharex=True))
        _draw_distributions(panels[0], table, laws, quantity)
        _draw_distributions(panels[1], table, laws, quantity, above=True)
        most = max(2, *table["law"].value_counts())
        panels[0].set(xlabel=quantity.label, ylabel="share of the runs at or below")
        panels[1].set(xlabel=quantity.label, ylabel="share of the runs above")
        panels[1].set(ylim=(0.5 / most, 1.5), yscale="log")
    panels[0].set(ylim=(0.0, 1.02), xscale="log")
    _number_log_axis(panels[0], "x")
    legend_above(figure, list(short_names(laws).values()), dashed=True)
    return figure


def _draw_distributions(
    axes: Axes, table: DataFrame, laws: Sequence[str], quantity: Quantity, above: bool = False
) -> None:
    for law in laws_in(table):
        index, values = laws.index(law), np.sort(penalised(law_rows(table, law), quantity.column))
        known = values[np.isfinite(values) & (values > 0.0)]
        if not len(known):
            continue
        count, style = len(known), LineStyle.of(index)
        ends = np.r_[: min(TAIL, count), max(0, count - TAIL) : count]
        even = np.linspace(0, count - 1, STEPS)
        drawn = np.unique(np.r_[ends, even].astype(np.intp))
        share = (np.sum(values <= 0.0) + drawn + 1) / len(values)
        if above:
            share = np.where(share < 1.0, 1.0 - share, np.nan)
        marked = int(np.searchsorted(drawn[:-1], (0.1 + 0.13 * index % 0.8) * count))
        axes.plot(
            known[drawn],
            share,
            color=style.colour,
            linestyle=style.dashes,
            marker=style.marker,
            markevery=[marked],
            drawstyle="steps-post",
        )
    if (demand := quantity.requirement) and demand.bound > 0.0:
        within = demand.share if demand.sign > 0 else 1.0 - demand.share
        axes.axvline(demand.bound, color=GREY, linewidth=0.8, linestyle=":")
        axes.axhline(1.0 - within if above else within, color=GREY, linewidth=0.8, linestyle=":")


@house_style()
def influence_figure(influences: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Draw the influence of each variable on a quantity, one panel per law.

    Bars show the share of the spread that a variable explains by itself, points its rank
    correlation (the partial one where it exists) with the confidence interval.
    """
    figure, panels, names = _variable_panels(influences, lambda influence: influence.strength)
    for axes, by_name in zip(panels, influences.values(), strict=False):
        for place, name in enumerate(names):
            if (influence := by_name.get(name)) is None:
                continue
            axes.barh(place, influence.spread, color=COLOURS[5], height=0.7)
            if best := influence.best_correlation:
                _draw_error_bar(axes, place, best, LineStyle.of(0), across=True, markersize=3.0)
        axes.set(xlim=(-1.0, 1.0), xticks=(-1.0, 0.0, 1.0))
        axes.xaxis.set_major_formatter("{x:g}")
    figure.supxlabel("bars: share of the spread; points: rank correlation")
    return figure


@house_style()
def sobol_figure(indices: Mapping[str, Mapping[str, Any]]) -> Figure:
    """Draw first and total Sobol indices of one metric, by law and variable; a panel per law."""
    figure, panels, names = _variable_panels(indices, lambda index: index.total.value)
    for axes, by_name in zip(panels, indices.values(), strict=False):
        for number, (kind, shift) in enumerate((("first", -0.2), ("total", 0.2))):
            for place, name in enumerate(names):
                estimate = getattr(by_name[name], kind)
                style = LineStyle.of(number)
                _draw_error_bar(axes, place + shift, estimate, style, across=True)
        axes.set(xlim=(-0.1, 1.1))
    figure.supxlabel("Sobol index")
    legend_above(figure, ["first", "total"], dashed=False)
    return figure


def _variable_panels(
    by_law: Mapping[str, Mapping[str, Any]], strength: Callable[[Any], float]
) -> tuple[Figure, Sequence[Axes], list[str]]:
    shown = list(by_law)[:MOST_LAWS]
    strongest: dict[str, float] = {}
    for law in shown:
        for name, influence in by_law[law].items():
            strongest[name] = max(strength(influence), strongest.get(name, -np.inf))
    names = sorted(strongest, key=lambda name: -strongest[name])[:MOST_VARIABLES]
    figure = page(24.0 + 6.0 * len(names))
    panels = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    for axes, title in zip(panels, short_names(shown).values(), strict=True):
        axes.axvline(0.0, color=COLOURS[0], linewidth=0.6)
        axes.set_title(plain(title))
    panels[0].set_yticks(range(len(names)), [plain(_shortened(name)) for name in names])
    panels[0].invert_yaxis()
    return figure, panels, names


def _shortened(name: str) -> str:
    half = (LONGEST - 1) // 2
    return name if len(name) <= LONGEST else f"{name[:half]}…{name[-half:]}"


def _draw_error_bar(
    axes: Axes,
    place: float,
    estimate: Estimate,
    style: LineStyle,
    across: bool = False,
    **options: Any,
) -> None:
    value, low, high = estimate
    error = [[max(0.0, value - low)], [max(0.0, high - value)]]
    options |= {"color": style.colour, "marker": style.marker}
    if across:
        axes.errorbar(value, place, xerr=error, **options)
    else:
        axes.errorbar(place, value, yerr=error, **options)
