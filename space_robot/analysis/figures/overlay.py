"""Figures of several overlaid flights: errors, torques, pointing, latency."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from ..analysed_log import ANGLES
from ..measure import column_label, column_unit
from .flight_curves import FlightCurves
from .style import GREY, LineStyle, house_style, legend_above, mark_events, page, plot_lines

Array = NDArray[np.float64]

USUAL = 0.5
"""Share of the ticks below the range of a logarithmic panel, %: errors begin at zero."""
BINS = 80
"""Bins of the latency's histogram."""


class _Panel(NamedTuple):
    curves: dict[str, tuple[Array, Array]]
    """Time, s, and values of each flight with data for a panel."""
    label: str
    is_logarithmic: bool
    limit: float | None = None
    """Drawn as a line across."""


@house_style()
def errors_and_torques(flights: Mapping[str, FlightCurves]) -> Figure:
    """Draw Figs. 6 to 9 of several flights: sizes of errors (left, logarithmic) and torques.

    Args:
        flights: by name.
    """
    torques = dict.fromkeys(name for curves in flights.values() for name in curves.torque_axes)
    names = dict.fromkeys(name for curves in flights.values() for name in curves.sizes)
    errors = [name for name in names if name.startswith(("attitude_angle", "joints_"))]
    panels = [_panels(flights, errors, True, " error"), _panels(flights, list(torques), False)]
    return _draw(panels, list(flights), _events(flights))


@house_style()
def pointing(flights: Mapping[str, FlightCurves]) -> Figure:
    """Draw the end effector's errors of boresight, rotation and position, and the base's drift."""
    panels = _panels(flights, ["boresight", "tool_attitude", "tool_position"], True, " error")
    if not panels:
        return page(12.0, "No robot is known for these flights, so no pointing error.")
    panels += _panels(flights, ["base_drift"], False)
    return _draw([panels], list(flights), _events(flights))


@house_style()
def base_pointing(flights: Mapping[str, FlightCurves], band_deg: float) -> Figure:
    """Draw the base's errors of pointing: half cone, about the axis that points, and in all.

    Args:
        flights: by name.
        band_deg: drawn as a line, degrees.
    """
    panels = _panels(flights, ANGLES, True, limit=3600.0 * band_deg)
    if not panels:
        return page(12.0, "Nothing turned the base of these flights, so no pointing error.")
    return _draw([panels], list(flights), _events(flights))


@house_style()
def latency_histogram(flights: Mapping[str, FlightCurves]) -> Figure:
    """Draw the histogram of latencies, for flights that were flown as a graph."""
    known = {name: s.latency_ms for name, s in flights.items() if s.latency_ms is not None}
    if not known:
        return page(12.0, "None of these flights was flown as a graph, so no latency.")
    figure = page(80.0)
    axes = figure.add_subplot()
    low = max(min(float(values.min()) for values in known.values()), 1e-3)
    high = max(float(values.max()) for values in known.values())
    edges = np.geomspace(low, max(high, 1.1 * low), BINS + 1)
    for index, values in enumerate(known.values()):
        look = LineStyle.of(index)
        counts, _ = np.histogram(np.maximum(values, low), edges)
        axes.stairs(counts, edges, color=look.colour, linestyle=look.dashes, linewidth=0.9)
    axes.set(
        xscale="log",
        yscale="log",
        xlabel="from a state's sending to its command's (ms)",
        ylabel="answers",
    )
    axes.set_ylim(bottom=0.7)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter("")
    axes.yaxis.set_major_formatter("{x:g}")
    legend_above(figure, list(known), dashed=True)
    return figure


def _events(flights: Mapping[str, FlightCurves]) -> Array:
    """Return the times of captures and releases in any flight, s."""
    times: Array = np.unique(np.concatenate([series.events for series in flights.values()]))
    return times


def _draw(columns: list[list[_Panel]], names: list[str], events: Array) -> Figure:
    """Plot columns of equally many panels over time, with one legend of all flights."""
    rows = len(columns[0])
    figure = page(18.0 + 38.0 * rows)
    grid = figure.subplots(rows, len(columns), sharex="col", squeeze=False)
    for panels, column in zip(columns, grid.T, strict=True):
        for axes, panel in zip(column, panels, strict=True):
            _draw_panel(axes, panel, names)
            mark_events(axes, events)
        column[-1].set_xlabel("time (s)")
    figure.align_ylabels()
    legend_above(figure, names, dashed=True)
    return figure


def _draw_panel(axes: Axes, panel: _Panel, names: list[str]) -> None:
    wildest_first = sorted(panel.curves, key=lambda name: -_roughness(panel.curves[name][1]))
    for depth, name in enumerate(wildest_first):  # at the back, so that it does not hide the others
        time, value = panel.curves[name]
        plot_lines(axes, time, value[:, np.newaxis], looks=[names.index(name)], dashed=True)
        axes.get_lines()[-1].set_zorder(2.0 + 0.01 * depth)
    if panel.is_logarithmic:
        known = [value[value > 0.0] for _, value in panel.curves.values()]
        usual = [float(np.percentile(value, USUAL)) for value in known if len(value)]
        if usual:
            axes.set_yscale("log", nonpositive="mask")
            axes.set_ylim(bottom=0.5 * min(usual))
    if panel.limit is not None:
        axes.axhline(panel.limit, color=GREY, linewidth=0.8, linestyle=":")
        axes.set_ylim(top=max(axes.get_ylim()[1], 2.0 * panel.limit))
    axes.set_ylabel(panel.label)


def _roughness(values: Array) -> float:
    return float(np.nansum(np.abs(np.diff(values))))


def _panels(
    flights: Mapping[str, FlightCurves],
    names: Sequence[str],
    is_logarithmic: bool,
    word: str = "",
    limit: float | None = None,
) -> list[_Panel]:
    """Return a panel for every column that any flight has; ``word`` follows its label."""
    panels = []
    for name in names:
        lines = {
            key: (curves.time, curves.sizes[name])
            for key, curves in flights.items()
            if name in curves.sizes
        }
        label = f"{column_label(name)}{word} ({column_unit(name)})"
        panels += [_Panel(lines, label, is_logarithmic, limit)] if lines else []
    return panels
