"""The figures of a report with their captions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

from matplotlib.figure import Figure

from ...analysis.figures.overlay import words
from ..verdicts.values import is_known
from .bands import MOST_PANELS, band_figure, series_of
from .distributions import distribution_figure
from .findings import Findings
from .influence_figures import grid_figure, influence_figure, sobol_figure

MOST_INFLUENCES = 4
"""Maximum number of grid points with a figure of influences; the table has all."""


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
        caption = f"{words(name)} over time: {lines} at each time{first}"
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
