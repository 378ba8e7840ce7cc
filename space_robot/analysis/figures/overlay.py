"""Figures of several overlaid flights: errors, torques, their ripple, pointing, latency."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from typing_extensions import Self

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..analysed_log import AnalysedLog, PointingBudget
from ..described import event_times
from ..errors import AxisIndex
from ..measure import column_definition, column_label
from ..plotted import PlottedQuantity, flown_quantities
from ..torques import RippleSpectrum, ripple_spectrum
from .base_torque import BaseTorque
from .style import (
    NARROW_PAGE,
    PAGE_WIDTH,
    LineStyle,
    house_style,
    legend_above,
    legend_inside,
    mark_events,
    mark_limits,
    page,
    plot_lines,
    plot_spectrum,
    total_variation,
)

DRAWN = ("attitude", "joints", "pointing", "tool", "base", "torques")
"""Kinds of quantities whose sizes are drawn over time."""
USUAL = 0.5
"""Share of the ticks below the range of a logarithmic panel, %: errors begin at zero."""
BINS = 80
"""Bins of the latency's histogram."""


class FlightCurves(NamedTuple):
    """Sizes of a flight's quantities over time, its base torque, ripple and latency."""

    time: Array
    """(N,) s."""
    sizes: list[tuple[str, PlottedQuantity]]
    """Kind and size of each quantity of `DRAWN`, its values (N, 1)."""
    base_torque: BaseTorque | None
    """None where nothing turned the base."""
    latency_ms: Array | None
    """(K,) of every answer, by the wall clock; None for flights without any."""
    ripple: RippleSpectrum | None
    """None where the robot is not known, or the flight is too short."""
    torque_axes: dict[str, AxisIndex]
    """The axes of each column of torques."""
    events: Array
    """Times of what was captured and released, s."""

    @classmethod
    def of(cls, log: FlightLog, budget: PointingBudget | None = None) -> Self:
        """Compute them from a flight; ``budget``: of the base's pointing, None: the default."""
        flight = AnalysedLog(log, budget)
        ripple = latency = None
        with suppress(InputError):
            ripple = ripple_spectrum(flight)
        if log.latency_s is not None:
            known = log.latency_s[np.isfinite(log.latency_s)]
            latency = 1e3 * known if len(known) else None
        return cls(
            log.time,
            [(kind, sized(quantity)) for kind, quantity in flown_quantities(flight, DRAWN)],
            BaseTorque.of(log) if flight.controls_base else None,
            latency,
            ripple,
            flight.torque_columns,
            event_times(log),
        )


def sized(quantity: PlottedQuantity) -> PlottedQuantity:
    """Return a quantity with its size at each tick as its only value."""
    return quantity._replace(values=quantity.size[:, np.newaxis], wanted=None)


class _Panel(NamedTuple):
    curves: dict[str, tuple[Array, Array]]
    """Time, s, and values of each flight with data for a panel."""
    label: str
    is_error: bool
    """Drawn on a logarithmic scale."""
    limit: float
    """Drawn as a line across; 0: none."""


@house_style()
def errors_and_torques(flights: Mapping[str, FlightCurves], width: float = PAGE_WIDTH) -> Figure:
    """Draw Figs. 6 to 9 of several flights: sizes of errors (left, logarithmic) and torques."""
    errors = [panel for panel in _panels(flights, "attitude", "joints") if panel.is_error]
    torques = _panels(flights, "torques")
    columns = [errors + torques] if width < NARROW_PAGE else [errors, torques]
    return _draw(columns, flights, width)


@house_style()
def pointing(flights: Mapping[str, FlightCurves], width: float = PAGE_WIDTH) -> Figure:
    """Draw the end effector's errors of boresight, rotation and position, and the base's drift."""
    panels = _panels(flights, "tool")
    if not panels:
        return page(12.0, "No robot is known for these flights, so no pointing error.")
    return _draw([panels + _panels(flights, "base")], flights, width)


@house_style()
def base_pointing(flights: Mapping[str, FlightCurves], width: float = PAGE_WIDTH) -> Figure:
    """Draw the base's pointing errors and the band: half cone, about the axis that points, all."""
    panels = _panels(flights, "pointing")
    if not panels:
        return page(12.0, "Nothing turned the base of these flights, so no pointing error.")
    return _draw([panels], flights, width)


@house_style()
def latency_histogram(flights: Mapping[str, FlightCurves], width: float = PAGE_WIDTH) -> Figure:
    """Draw the histogram of latencies, for flights that were flown as a graph."""
    known = {name: s.latency_ms for name, s in flights.items() if s.latency_ms is not None}
    if not known:
        return page(12.0, "None of these flights was flown as a graph, so no latency.")
    figure = page(80.0, width=width)
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
    legend_inside(axes, list(known), dashed=True)
    return figure


@house_style()
def ripple(flights: Mapping[str, FlightCurves], width: float = PAGE_WIDTH) -> Figure:
    """Draw the spectral density of the ripple, one panel per group of axes (mean of the axes)."""
    known = {name: s.ripple for name, s in flights.items() if s.ripple is not None}
    if not known:
        return page(12.0, "None of these flights has a known robot and is long enough for ripple.")
    columns = [flights[name].torque_axes for name in known]
    groups = {key: axes for column in columns for key, axes in column.items()}
    figure = page(18.0 + 55.0 * len(groups), width=width)
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
            shown = np.where(density > 0.0, density, np.nan)
            plot_spectrum(panel, frequency, shown, names.index(name), len(names))
        squared = "N²" if column_definition(key).unit == "N" else "(N m)²"
        panel.set(xscale="log", yscale="log", ylabel=f"PSD of {column_label(key)} ({squared}/Hz)")
    panels[-1].set_xlabel("frequency (Hz)")
    panels[-1].xaxis.set_major_formatter("{x:g}")
    figure.align_ylabels()
    if len(names) > 1:
        legend_above(figure, names, dashed=True)
    return figure


def _draw(columns: list[list[_Panel]], flights: Mapping[str, FlightCurves], width: float) -> Figure:
    rows, names = len(columns[0]), list(flights)
    events = np.unique(np.concatenate([curves.events for curves in flights.values()]))
    figure = page(18.0 + 38.0 * rows, width=width)
    grid = figure.subplots(rows, len(columns), sharex="col", squeeze=False)
    for panels, column in zip(columns, grid.T, strict=True):
        for axes, panel in zip(column, panels, strict=True):
            _draw_panel(axes, panel, names)
            mark_events(axes, events)
        column[-1].set_xlabel("time (s)")
    figure.align_ylabels()
    if len(names) > 1:
        legend_above(figure, names, dashed=True)
    return figure


def _draw_panel(axes: Axes, panel: _Panel, names: list[str]) -> None:
    wildest_first = sorted(panel.curves, key=lambda name: -total_variation(panel.curves[name][1]))
    for depth, name in enumerate(wildest_first):  # at the back, so that it does not hide the others
        time, value = panel.curves[name]
        if panel.is_error:  # zeros have no place on its logarithmic scale
            value = np.where(value > 0.0, value, np.nan)
        plot_lines(axes, time, value[:, np.newaxis], looks=[names.index(name)], dashed=True)
        axes.get_lines()[-1].set_zorder(2.0 + 0.01 * depth)
    if panel.is_error:
        known = [value[value > 0.0] for _, value in panel.curves.values()]
        usual = [float(np.percentile(value, USUAL)) for value in known if len(value)]
        if usual:
            axes.set_yscale("log", nonpositive="mask")
            axes.set_ylim(bottom=0.5 * min(usual))
    if panel.limit:
        mark_limits(axes, [panel.limit], np.concatenate([v for _, v in panel.curves.values()]))
    axes.set_ylabel(panel.label)


def _panels(flights: Mapping[str, FlightCurves], *kinds: str) -> list[_Panel]:
    panels: dict[str, _Panel] = {}
    for name, curves in flights.items():
        for quantity in (quantity for kind, quantity in curves.sizes if kind in kinds):
            label, limit = quantity.label, max(quantity.limits, default=0.0)
            panel = panels.setdefault(label, _Panel({}, label, quantity.is_error, limit))
            panel.curves[name] = curves.time, quantity.values[:, 0]
    return list(panels.values())
