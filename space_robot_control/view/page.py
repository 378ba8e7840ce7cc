"""One page with the scene and plots that follow it."""

from __future__ import annotations

import json
from collections.abc import Sequence
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis.template import template

Array = NDArray[np.float64]


class Series(NamedTuple):
    """A line of a plot."""

    label: str
    colour: str
    values: Array
    """(K,)"""
    dash: tuple[int, ...] = ()


class Plot(NamedTuple):
    """A plot over time."""

    title: str
    unit: str
    time: Array
    """(K,) s."""
    series: Sequence[Series]


class Shown(NamedTuple):
    """A bag on the page."""

    name: str
    colour: str
    what: str


def render(
    title: str,
    scene: str,
    bags: Sequence[Shown],
    plots: Sequence[Plot],
    events: Sequence[tuple[float, str]],
) -> str:
    """Render the page, without references to anything outside itself.

    Args:
        title: of the page.
        scene: viser's own page of the scene.
        bags: that are shown.
        plots: in their order.
        events: time, s, and words.
    """
    folder = files(__package__).joinpath("templates")
    data = {
        "plots": [
            {
                "title": plot.title, "unit": plot.unit, "time": _short(plot.time, 4),
                "series": [
                    {
                        "label": s.label, "colour": s.colour, "values": _digits(s.values),
                        "dash": list(s.dash),
                    }
                    for s in plot.series
                ],
            }
            for plot in plots
        ],
        "events": [{"t": time, "text": text} for time, text in events],
    }  # fmt: skip
    return template("space_robot_control.view", "view.html.j2").render(
        title=title, scene=scene, bags=bags,
        uplot=folder.joinpath("uPlot.iife.min.js").read_text("utf-8"),
        uplot_css=folder.joinpath("uPlot.min.css").read_text("utf-8"),
        script=folder.joinpath("view.js").read_text("utf-8"),
        data=json.dumps(data, separators=(",", ":")).replace("</", "<\\/"),
    )  # fmt: skip


def _short(values: Array, decimals: int) -> list[float]:
    return [float(x) for x in np.round(values, decimals)]


def _digits(values: Array) -> list[Any]:
    return [float(f"{x:.4g}") if np.isfinite(x) else None for x in values]
