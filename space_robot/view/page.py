"""HTML page with the scene and synchronised plots."""

from __future__ import annotations

import math
from collections.abc import Sequence
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..analysis.page import template
from .arrows import ArrowKind
from .marks import Mark
from .plots import Plot

Array = NDArray[np.float64]


class Shown(NamedTuple):
    """A flight on the page."""

    name: str
    colour: str
    what: str
    warnings: Sequence[str] = ()
    """Defects of its recording, a sentence each."""


def render(
    title: str,
    scene: str,
    bags: Sequence[Shown],
    plots: Sequence[Plot],
    marks: Sequence[Mark],
    start: float,
    dark: bool,
    arrows: Sequence[ArrowKind] = (),
    notes: Sequence[str] = (),
) -> str:
    """Render the self-contained page.

    Args:
        title: of the page.
        scene: viser's page of the scene.
        bags: that are shown.
        plots: in order, with a common time.
        marks: on the time axis.
        start: time of the first frame, s.
        dark: whether the page is light on dark.
        arrows: at the bases of robots in orbit.
        notes: on how things are drawn, a sentence each.
    """
    folder = files(__package__).joinpath("templates")
    data = {
        "plots": [
            {
                "title": plot.title,
                "unit": plot.unit,
                "logarithmic": plot.is_logarithmic,
                "pulses": plot.are_pulses,
                "shown": plot.is_shown,
                "series": [
                    {
                        "label": s.label,
                        "colour": s.colour,
                        "values": _digits(s.values, plot.is_logarithmic),
                    }
                    for s in plot.series
                ],
            }
            for plot in plots
        ],
        "marks": [
            {
                "start": m.start,
                "stop": m.stop if math.isfinite(m.stop) else None,
                "text": m.text,
                "kind": m.kind,
            }
            for m in marks
        ],
        "time": _short(plots[0].time, 4) if plots else [],
        "start": start,
        "dark": dark,
    }
    return template("space_robot.view", "view.html.j2").render(
        title=title,
        scene=scene,
        bags=bags,
        dark=dark,
        uplot=folder.joinpath("uPlot.iife.min.js").read_text("utf-8"),
        uplot_css=folder.joinpath("uPlot.min.css").read_text("utf-8"),
        css=folder.joinpath("view.css").read_text("utf-8"),
        orbit_css=folder.joinpath("orbit.css").read_text("utf-8") if arrows else "",
        arrows=arrows,
        notes=notes,
        script=folder.joinpath("view.js").read_text("utf-8"),
        data=data,
    )


def _short(values: Array, decimals: int) -> list[float]:
    return [float(x) for x in np.round(values, decimals)]


def _digits(values: Array, is_logarithmic: bool) -> list[Any]:
    known = np.isfinite(values) & ~(is_logarithmic & (values <= 0.0))
    return [float(f"{x:.4g}") if k else None for x, k in zip(values, known, strict=True)]
