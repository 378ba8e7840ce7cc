"""Figures of sensitivities, and of laws over the points of a grid."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from ...analysis.figures.style import COLOURS, LineStyle, house_style, legend_above, page, plain
from ..study import short_names
from ..verdicts.sensitivity import Sensitivity
from ..verdicts.sobol import SobolIndices
from ..verdicts.values import GridPoint, laws_of, measured, of_law
from .axes import law_legend, number_log_axis
from .quantities import Quantity

SHOWN = 10
"""Maximum number of variables drawn: the strongest over all laws."""
PANELS = 5
"""Maximum number of laws, one panel each."""
LONGEST = 34
"""Maximum length of a variable's name, in characters."""


@house_style()
def influence_figure(sensitivities: Sequence[Sensitivity]) -> Figure:
    """Draw the influence of each variable on a quantity, one panel per law.

    Bars show the share of the spread that a variable explains by itself, points its rank
    correlation (the partial one where it exists) with the confidence interval.

    Args:
        sensitivities: of one quantity, one per law.
    """
    shown = sensitivities[:PANELS]
    strength: dict[str, float] = {}
    for each in shown:
        for i in each.influences:
            best = i.partial or i.correlation
            own = max(i.spread, best.value**2 if best else 0.0)
            strength[i.variable] = max(own, strength.get(i.variable, 0.0))
    names = sorted(strength, key=lambda name: -strength[name])[:SHOWN]
    figure = page(22.0 + 5.0 * len(names))
    panels = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    laws = short_names([each.law for each in shown])
    for axes, each in zip(panels, shown, strict=True):
        by_name = {i.variable: i for i in each.influences}
        for place, name in enumerate(names):
            if (influence := by_name.get(name)) is None:
                continue
            axes.barh(place, influence.spread, color=COLOURS[5], height=0.7)
            if best := influence.partial or influence.correlation:
                value, low, high = best
                axes.errorbar(
                    value,
                    place,
                    xerr=[[value - low], [high - value]],
                    color=COLOURS[0],
                    marker="o",
                    markersize=3.0,
                )
        axes.axvline(0.0, color=COLOURS[0], linewidth=0.6)
        axes.set(xlim=(-1.0, 1.0), xticks=(-1.0, 0.0, 1.0), title=plain(laws[each.law]))
        axes.xaxis.set_major_formatter("{x:g}")
    panels[0].set_yticks(range(len(names)), [plain(_short(name)) for name in names])
    panels[0].invert_yaxis()
    figure.supxlabel("bars: share of the spread; points: rank correlation")
    return figure


@house_style()
def sobol_figure(indices: Sequence[SobolIndices]) -> Figure:
    """Draw first and total Sobol indices of one metric, one panel per law."""
    shown = indices[:PANELS]
    largest: dict[str, float] = {}
    for each in shown:
        for i in each.indices:
            largest[i.variable] = max(i.total.value, largest.get(i.variable, -np.inf))
    names = sorted(largest, key=lambda name: -largest[name])[:SHOWN]
    figure = page(24.0 + 6.0 * len(names))
    panels = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    laws = short_names([each.law for each in shown])
    for axes, each in zip(panels, shown, strict=True):
        by_name = {i.variable: i for i in each.indices}
        for kind, shift in (("first", -0.2), ("total", 0.2)):
            look = LineStyle.of(("first", "total").index(kind))
            for place, name in enumerate(names):
                value, low, high = getattr(by_name[name], kind)
                error = [[max(0.0, value - low)], [max(0.0, high - value)]]
                axes.errorbar(
                    value, place + shift, xerr=error, color=look.colour, marker=look.marker
                )
        axes.axvline(0.0, color=COLOURS[0], linewidth=0.6)
        axes.set(xlim=(-0.1, 1.1), title=plain(laws[each.law]))
    panels[0].set_yticks(range(len(names)), [plain(_short(name)) for name in names])
    panels[0].invert_yaxis()
    figure.supxlabel("Sobol index")
    legend_above(figure, ["first", "total"], dashed=False)
    return figure


def _short(name: str) -> str:
    """Shorten a long name in its middle: both ends distinguish it from others."""
    if len(name) <= LONGEST:
        return name
    half = (LONGEST - 1) // 2
    return f"{name[:half]}…{name[-half:]}"


@house_style()
def grid_figure(
    parts: Sequence[GridPoint],
    laws: Sequence[str],
    metrics: Sequence[Quantity],
    names: Sequence[str],
) -> Figure:
    """Draw every metric at every point of a grid: medians, with bars from 5 % to 95 % of the runs.

    Args:
        parts: the points of the grid.
        laws: of the campaign.
        metrics: one panel each.
        names: of the grid's variables.
    """
    figure = page(24.0 + 42.0 * len(metrics))
    panels = figure.subplots(len(metrics), 1, sharex=True, squeeze=False)[:, 0]
    for axes, metric in zip(panels, metrics, strict=True):
        for index, law in enumerate(laws):
            look, shift = LineStyle.of(index), 0.7 / len(laws) * (index - 0.5 * (len(laws) - 1))
            for place, part in enumerate(parts):
                if law not in laws_of(part.table):
                    continue
                values = measured(of_law(part.table, law), metric.column)
                shares = (0.05, 0.5, 0.95)
                low, middle, high = np.quantile(values, shares, method="inverted_cdf").tolist()
                if not np.isfinite(middle):
                    continue  # most of them failed
                top = high if np.isfinite(high) else float(values[np.isfinite(values)].max())
                axes.errorbar(
                    place + shift,
                    middle,
                    yerr=[[middle - low], [top - middle]],
                    color=look.colour,
                    marker=look.marker,
                    linewidth=0.8,
                )
        axes.set_yscale("log")
        number_log_axis(axes, "y")
        axes.set_ylabel(metric.label)
    ticks = ["\n".join(map(plain, part.values)) for part in parts]
    panels[-1].set_xticks(range(len(parts)), ticks)
    panels[-1].set_xlim(-0.5, len(parts) - 0.5)
    panels[-1].set_xlabel(", ".join(plain(name.removeprefix("scenario.")) for name in names))
    figure.align_ylabels()
    law_legend(figure, laws, dashed=False)
    return figure
