"""Several flights in the same panels, a line each: errors, torques, pointing, latency."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullLocator
from numpy.typing import NDArray

from ..course import Course
from ..pointing import ARCSEC
from .envelope import envelope
from .lines import scattered_marks
from .quantity import Quantity, power_of_ten
from .scale import draw_scales
from .style import (
    LEFT,
    PAGE_WIDTH,
    RIGHT,
    TIME_AXIS,
    Look,
    house_style,
    legend_above,
    legend_height,
    page,
    panel,
)

Array = NDArray[np.float64]
Curves = dict[str, tuple[Array, Array]]
"""Time, s, and values of each flight that has them."""

USUAL = 0.5
"""% of the ticks that may lie below a logarithmic panel: an error begins at zero."""
BINS = 80
"""Of the latency's histogram."""

_WIDTH = PAGE_WIDTH - LEFT - RIGHT
_HALF = (PAGE_WIDTH - 2 * LEFT - 2 * RIGHT) / 2
_HEIGHT, _GAP = 34.0, 4.0


class _Panel(NamedTuple):
    curves: Curves
    name: str
    unit: str
    logarithmic: bool


@house_style()
def errors_and_torques(courses: Mapping[str, Course]) -> Figure:
    """Figs. 6 to 9 of several flights: norms of errors (left, logarithmic) and torques (right).

    Args:
        courses: by name of the flight.
    """
    left = [
        _Panel(_curves(courses, "errors", key), f"|{_plain(key)} error|", unit, True)
        for key in _keys(courses, "errors")
        for unit in ["" if key == "attitude" else "rad"]
    ]
    right = [
        _Panel(_curves(courses, "torques", key), f"|{_plain(key)}|", "N m", False)
        for key in _keys(courses, "torques")
    ]
    top = 1.0 + legend_height(list(courses), _WIDTH)
    rows = max(len(left), len(right))
    figure = page(top + rows * (_HEIGHT + _GAP) - _GAP + TIME_AXIS)
    for x, panels in ((LEFT, left), (PAGE_WIDTH - RIGHT - _HALF, right)):
        for row, shown in enumerate(panels):
            axes = panel(figure, x, top + row * (_HEIGHT + _GAP), _HALF, _HEIGHT)
            _draw(axes, shown, list(courses), last=row == len(panels) - 1)
    legend_above(figure, LEFT, top, list(courses), _WIDTH, dashed=True)
    return figure


@house_style()
def pointing(courses: Mapping[str, Course]) -> Figure:
    """The end effector's pointing: boresight angle, whole rotation, position, base's drift."""
    known = {name: course for name, course in courses.items() if course.pointing is not None}
    if not known:
        return page(12.0, "No robot is known for these flights, so no pointing error.")
    panels = []
    for field, name, unit, scale in (
        ("boresight", "boresight error", "arcsec", ARCSEC),
        ("rotation", "rotation error", "arcsec", ARCSEC),
        ("position", "tool position error", "m", 1.0),
        ("base_drift", "base's drift", "m", 1.0),
    ):
        curves = {
            key: (course.time, getattr(course.pointing, field) / scale)
            for key, course in known.items()
        }
        panels.append(_Panel(curves, name, unit, field != "base_drift"))
    top = 1.0 + legend_height(list(courses), _WIDTH)
    figure = page(top + 4 * (_HEIGHT + _GAP) - _GAP + TIME_AXIS)
    for row, shown in enumerate(panels):
        axes = panel(figure, LEFT, top + row * (_HEIGHT + _GAP), _WIDTH, _HEIGHT)
        _draw(axes, shown, list(courses), last=row == 3)
    legend_above(figure, LEFT, top, list(courses), _WIDTH, dashed=True)
    return figure


@house_style()
def latency_histogram(courses: Mapping[str, Course]) -> Figure:
    """How many answers took how long, of the flights that know."""
    known = {name: c.latency_ms for name, c in courses.items() if c.latency_ms is not None}
    if not known:
        return page(12.0, "None of these flights was flown as a graph, so no latency.")
    top, height = 1.0 + legend_height(list(known), _WIDTH), 62.0
    figure = page(top + height + TIME_AXIS)
    axes = panel(figure, LEFT, top, _WIDTH, height)
    low = min(float(values.min()) for values in known.values())
    high = max(float(values.max()) for values in known.values())
    low = max(low, 1e-3)
    edges = np.geomspace(low, max(high, 1.1 * low), BINS + 1)
    for index, values in enumerate(known.values()):
        look = Look.of(index)
        counts, _ = np.histogram(np.maximum(values, low), edges)
        axes.stairs(counts, edges, color=look.colour, linestyle=look.dashes, linewidth=0.9)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_ylim(bottom=0.7)
    axes.set_xlabel("from a state's sending to its command's (ms)")
    axes.set_ylabel("answers")
    axes.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    axes.xaxis.set_minor_formatter(FuncFormatter(lambda x, _: ""))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    legend_above(figure, LEFT, top, list(known), _WIDTH, dashed=True)
    return figure


def _draw(axes: Axes, shown: _Panel, names: list[str], *, last: bool) -> None:
    values = [value for _, value in shown.curves.values()]
    if shown.logarithmic:
        quantity = Quantity(shown.name, shown.unit)
        axes.set_yscale("log")
    else:
        quantity = Quantity.of(np.concatenate(values or [np.zeros(1)]), shown.name, shown.unit)
    axes.set_ylabel(quantity.label)
    for name, depth in _depths(shown.curves).items():
        (time, value), index = shown.curves[name], names.index(name)
        look, kept = Look.of(index), envelope(value)
        marked = scattered_marks(len(time), index, len(names))
        drawn = np.union1d(kept, marked)
        scaled = quantity.scaled(value[drawn])
        axes.plot(
            time[drawn], np.where(scaled > 0.0, scaled, np.nan) if shown.logarithmic else scaled,
            color=look.colour, linestyle=look.dashes, marker=look.marker, zorder=depth,
            markevery=np.searchsorted(drawn, marked).tolist(),
        )  # fmt: skip
    times = [time for time, _ in shown.curves.values()]
    low, high = min(float(t[0]) for t in times), max(float(t[-1]) for t in times)
    margin = 0.01 * (high - low) or 0.01
    axes.set_xlim(low - margin, high + margin)
    axes.set_xlabel("time (s)" if last else "")
    if shown.logarithmic:
        known = [value[value > 0.0] for value in values]
        axes.set_ylim(
            bottom=min((np.percentile(v, USUAL) / 2.0 for v in known if len(v)), default=None)
        )
        axes.yaxis.set_major_formatter(
            FuncFormatter(lambda y, _: power_of_ten(round(math.log10(y))) if y > 0.0 else "")
        )
        axes.yaxis.set_minor_locator(NullLocator())
    draw_scales(axes, x_numbers=last)


def _depths(curves: Curves) -> dict[str, float]:
    """How far in front each line lies: the wildest at the back, for it would hide the others."""
    roughness = {
        name: np.nansum(np.abs(np.diff(value[envelope(value)])))
        for name, (_, value) in curves.items()
    }
    order = sorted(curves, key=lambda name: -roughness[name])
    return {name: 2.0 + 0.01 * place for place, name in enumerate(order)}


def _keys(courses: Mapping[str, Course], field: str) -> list[str]:
    return list(dict.fromkeys(key for c in courses.values() for key in getattr(c, field)))


def _curves(courses: Mapping[str, Course], field: str, key: str) -> Curves:
    return {
        name: (course.time, getattr(course, field)[key])
        for name, course in courses.items()
        if key in getattr(course, field)
    }


def _plain(key: str) -> str:
    """``joints_1_3`` as in a label: joints 1-3."""
    word, _, axes = key.partition("_")
    if not axes or not axes[0].isdigit():
        return key.replace("_", " ")
    return f"{word} {axes.replace('_', '-')}"
