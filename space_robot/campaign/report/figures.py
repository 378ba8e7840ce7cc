"""The figures of a report with their captions."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ...analysis.figures.style import GREY, LineStyle, grid, house_style, page, plain
from ...analysis.measure import column_label
from ..verdicts.values import GridPoint, is_known, laws_of, measured, of_law
from .axes import law_legend, number_log_axis
from .bands import MOST_PANELS, band_figure, columns_of, series_of
from .findings import Findings
from .influence_figures import grid_figure, influence_figure, sobol_figure
from .quantities import Quantity

if TYPE_CHECKING:
    from pandas import DataFrame

MOST_INFLUENCES = 4
"""Maximum number of grid points with a figure of influences; the table has all."""


Array = NDArray[np.float64]

STEPS, TAIL = 200, 60
"""Steps of a curve; the `TAIL` runs at either end are drawn individually."""
SMALL = 60
"""Steps of a curve in a small panel."""


@house_style()
def distribution_figure(
    parts: Sequence[GridPoint], laws: Sequence[str], quantity: Quantity
) -> Figure:
    """Draw the cumulative distribution, and without a grid also its complement.

    Args:
        parts: points of the grid; one if there is no grid.
        laws: of the campaign.
        quantity: to be drawn, with its limit if it has one.
    """
    if len(parts) == 1:
        return _with_tail(parts[0].table, laws, quantity)
    shown = parts[:MOST_PANELS]
    columns = columns_of(len(shown))
    figure = page(16.0 + 42.0 * -(-len(shown) // columns))
    panels = grid(figure, len(shown), columns)
    for axes, part in zip(panels, shown, strict=True):
        for law in laws_of(part.table):
            _draw(axes, _numbers(part.table, law, quantity), laws.index(law), small=True)
        axes.set_title(plain(part.point))
    for axes in panels:
        _mark_limit(axes, quantity, False)
    panels[0].set(ylim=(0.0, 1.02), xscale="log")
    number_log_axis(panels[0], "x")
    for number in range(0, len(panels), columns):
        panels[number].set_ylabel("share of the runs")
    for axes in panels[-columns:]:
        axes.set_xlabel(quantity.label)
    law_legend(figure, laws)
    return figure


def _with_tail(table: DataFrame, laws: Sequence[str], quantity: Quantity) -> Figure:
    figure = page(72.0)
    below, above = figure.subplots(1, 2, sharex=True)
    most = 2  # runs
    for law in laws:
        values = _numbers(table, law, quantity)
        most = max(most, len(values))
        _draw(below, values, laws.index(law))
        _draw(above, values, laws.index(law), above=True)
    _mark_limit(below, quantity, False)
    _mark_limit(above, quantity, True)
    below.set(ylim=(0.0, 1.02), xscale="log", ylabel="share of the runs at or below")
    above.set(ylim=(0.5 / most, 1.5), yscale="log", ylabel="share of the runs above")
    number_log_axis(below, "x")
    for axes in (below, above):
        axes.set_xlabel(quantity.label)
    law_legend(figure, laws)
    return figure


def _numbers(table: DataFrame, law: str, quantity: Quantity) -> Array:
    """Return a law's sorted values; those of failed flights are infinite."""
    numbers: Array = np.sort(measured(of_law(table, law), quantity.column))
    return numbers


def _draw(axes: Axes, values: Array, index: int, above: bool = False, small: bool = False) -> None:
    """Draw one curve; with failed flights it does not reach 1 (or 0)."""
    runs, look = len(values), LineStyle.of(index)
    known = values[np.isfinite(values) & (values > 0.0)]
    if not len(known):
        return
    zeros = int(np.sum(values <= 0.0))
    steps, tail = (SMALL, 0) if small else (STEPS, TAIL)
    ends = np.r_[: min(tail, len(known)), max(0, len(known) - tail) : len(known)]
    even = np.linspace(0, len(known) - 1, steps).astype(np.intp)
    drawn = np.unique(np.r_[ends, even]).astype(np.intp)
    share = (zeros + drawn + 1) / runs
    if above:
        share = np.where(share < 1.0, 1.0 - share, np.nan)
    axes.plot(known[drawn], share, color=look.colour, linestyle=look.dashes, drawstyle="steps-post")
    marks = np.searchsorted(drawn, ((0.1 + 0.13 * index % 0.8) * len(known),)).clip(
        0, len(drawn) - 1
    )
    axes.plot(known[drawn][marks], share[marks], color=look.colour, marker=look.marker)


def _mark_limit(axes: Axes, quantity: Quantity, above: bool) -> None:
    """Draw a requirement's limit, and the required share of the runs."""
    if quantity.requirement is None or quantity.limit is None or quantity.limit <= 0.0:
        return
    share = quantity.requirement.share
    within = share if quantity.sign > 0 else 1.0 - share
    axes.axvline(quantity.limit, color=GREY, linewidth=0.8, linestyle=":")
    axes.axhline(1.0 - within if above else within, color=GREY, linewidth=0.8, linestyle=":")


class CampaignDrawing(NamedTuple):
    """A figure that is drawn on demand."""

    section: str
    """``league``, ``bands``, ``distributions`` or ``sensitivity``."""
    stem: str
    """Name of its file."""
    caption: str
    draw: Callable[[], Figure]


def drawings(findings: Findings) -> Iterator[CampaignDrawing]:
    """Yield all figures for which there are rows, without drawing them."""
    subject, parts, laws = findings.subject, findings.parts, findings.laws
    known = [q for q in findings.metrics if is_known(subject.table, q.column)]
    several = len(parts) > 1
    if several and known:
        caption = "Medians, with bars from 5 % to 95 % of the runs, at every point of the grid"
        draw = partial(grid_figure, parts, laws, known, findings.grid)
        yield CampaignDrawing("league", "grid", caption, draw)
    first = f" (the first {MOST_PANELS} points of the grid)" if len(parts) > MOST_PANELS else ""
    lines = "median (thick) and 95 % (thin) of the runs" if several else "percentiles of the runs"
    for name in series_of(subject.table):
        caption = f"{column_label(name)} over time: {lines} at each time{first}"
        draw = partial(band_figure, parts, laws, name, subject.time_s)
        yield CampaignDrawing("bands", f"band_{name}", caption, draw)
    required = [q for q in findings.required if is_known(subject.table, q.column)]
    for quantity in [*required, *known]:
        of = f" ({quantity.name})" if quantity.requirement else ""
        caption = f"Distribution of {quantity.heading}{of} over the runs{first}"
        draw = partial(distribution_figure, parts, laws, quantity)
        yield CampaignDrawing("distributions", f"distribution_{quantity.name}", caption, draw)
    for quantity in findings.driven:
        for number, part in enumerate(parts[:MOST_INFLUENCES]):
            of = f", {part.point}" if part.point else ""
            matching = [s for p, q, s in findings.sensitivities if (p, q) == (part, quantity)]
            if matching:
                caption = f"What drives {quantity.heading}{of}"
                stem = f"influence_{quantity.name}_{number}"
                yield CampaignDrawing(
                    "sensitivity", stem, caption, partial(influence_figure, matching)
                )
    for metric in dict.fromkeys(s.metric for s in findings.sobol):
        found_indices = [s for s in findings.sobol if s.metric == metric]
        caption = f"Sobol indices of {metric}"
        draw = partial(sobol_figure, found_indices)
        yield CampaignDrawing("sensitivity", f"sobol_{metric}", caption, draw)


def summary_figure(findings: Findings) -> Figure | None:
    """Draw the most important figure: the first of the laws, or of the distributions."""
    by_section = {drawing.section: drawing for drawing in reversed([*drawings(findings)])}
    chosen = by_section.get("league") or by_section.get("distributions")
    return chosen.draw() if chosen else None
