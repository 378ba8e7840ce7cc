"""Figures of a stability study: the Nyquist plot of G (74) and V(t) against its bound (55)."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis.figures.style import COLOURS, GREY, grid, house_style, page, plain, save_figure
from .lyapunov import transfer_function
from .stability import StabilityStudy, SuperTwisting

BLACK, BLUE, ORANGE = COLOURS[0], COLOURS[2], COLOURS[6]
POINTS = 1500
"""Points of a line, which limits the size of the SVG."""


def draw(study: StabilityStudy, folder: Path) -> list[Path]:
    """Write ``nyquist`` and ``lyapunov`` as PNG and SVG; nothing for a law without K_1 and K_2."""
    if study.super_twisting is None:
        return []
    figures = {
        "nyquist": nyquist(study.super_twisting, study.axis_names),
        "lyapunov": lyapunov(study.super_twisting, study.axis_names),
    }
    return [file for name, figure in figures.items() for file in save_figure(figure, folder / name)]


@house_style()
def nyquist(twisting: SuperTwisting, names: tuple[str, ...]) -> Figure:
    """Draw G(j omega) of each distinct pair of gains, with the circles of (73).

    The criterion holds if the curve lies within the circle of radius 1 / beta. The circle of the
    tolerated beta is the smallest that contains the curve; the measured beta is the smallest one of
    the axes with these gains.
    """
    groups: dict[tuple[float, float], list[int]] = {}
    for number, axis in enumerate(twisting.axes):
        if min(axis.k_1, axis.k_2) > 0.0:
            groups.setdefault((axis.k_1, axis.k_2), []).append(number)
    columns = max(1, min(2, len(groups)))
    figure = page(14.0 + 78.0 * max(1, math.ceil(len(groups) / columns)))
    panels = grid(figure, len(groups), columns, shared=False)
    for panel, (gains, axes) in zip(panels, groups.items(), strict=True):
        tolerated = twisting.axes[axes[0]].tolerated_beta
        measured = min(twisting.axes[axis].beta for axis in axes)
        _nyquist_panel(panel, gains, tolerated, measured)
        panel.set_title(
            f"{plain(', '.join(names[axis] for axis in axes))}\n"
            rf"$\beta$ tolerated {tolerated:.3g}, measured {measured:.3g} or more"
        )
    figure.supxlabel(r"real part of $G(j\omega)$ (s$^3$/rad; base: s$^3$)")
    figure.supylabel(r"imaginary part of $G(j\omega)$ (s$^3$/rad; base: s$^3$)")
    _legend(figure, panels)
    return figure


def _nyquist_panel(
    panel: Axes, gains: tuple[float, float], tolerated: float, measured: float
) -> None:
    half = np.geomspace(1e-3, 1e3, POINTS) * math.sqrt(gains[1] / 2.0)
    g = transfer_function(*gains, np.concatenate([-half[::-1], half]))
    angle = np.linspace(0.0, 2.0 * np.pi, 361)
    x, y = np.cos(angle), np.sin(angle)
    label = r"radius 1/$\beta$, $\beta$ tolerated"
    panel.plot(x / tolerated, y / tolerated, "--", color=BLUE, label=label, linewidth=1.0)
    if measured > 0.0:
        label = r"radius 1/$\beta$, $\beta$ measured"
        panel.plot(x / measured, y / measured, color=ORANGE, label=label, linewidth=1.6)
    panel.plot(g.real, g.imag, color=BLACK, label=r"$G(j\omega)$, all $\omega$")
    if measured > 0.0:  # its circle may be too small to be visible
        panel.plot(0.0, 0.0, "o", color=ORANGE, markersize=3.0)
    panel.set_aspect("equal")
    reach = 1.1 / tolerated
    panel.set(xlim=(-reach, reach), ylim=(-reach, reach))
    panel.locator_params(nbins=5)


@house_style()
def lyapunov(twisting: SuperTwisting, names: tuple[str, ...]) -> Figure:
    """Draw V(t) of (47) in the flight from the initial error, with the bound (55), per axis.

    V is divided by V(0), because its unit, that of beta^2 |s| / K_1, has no meaning. The maximum in
    each time step of the figure is drawn, so that no peak above the bound is lost.
    """
    figure = page(14.0 + 46.0 * math.ceil(len(names) / 3))
    panels = grid(figure, len(names), 3, shared=False)
    time, eta = twisting.reaching.time, twisting.reaching.eta
    steps = np.unique(np.geomspace(1, len(time) - 1, POINTS).astype(int))
    for number, (panel, name, axis) in enumerate(zip(panels, names, twisting.axes, strict=True)):
        panel.set_title(plain(name))
        certificate, check = axis.certificate, axis.reaching_time
        value = certificate.value(eta[:, number]) if certificate else np.zeros(1)
        start = float(value[0])
        if certificate is None or start == 0.0:
            text = "no solution of (51)" if certificate is None else "V(0) = 0"
            panel.text(0.5, 0.5, text, ha="center", transform=panel.transAxes)
            continue
        peaks = np.maximum.reduceat(value, steps) / start
        panel.loglog(time[steps], peaks, color=BLUE, linewidth=0.7, label="measured")
        until = np.geomspace(time[1], 0.999 * check.limit, POINTS)
        label = rf"bound (55) for the {'measured' if axis.measured else 'assumed'} $\beta$"
        bound = certificate.bound(start, until) / start
        panel.loglog(until, bound, "--", color=ORANGE, label=label)
        if math.isfinite(check.value):
            panel.axvline(check.value, color=GREY, linestyle=":", label="|s| reached")
        panel.set(ylim=(1e-8, 1e3), xlim=(time[1], None))
        panel.minorticks_off()
    figure.supxlabel("time (s)")
    figure.supylabel("V(t) / V(0) (dimensionless)")
    _legend(figure, panels)
    return figure


def _legend(figure: Figure, panels: list[Axes]) -> None:
    """Draw one legend of all kinds of lines above all panels."""
    lines = {
        label: handle
        for panel in panels
        for handle, label in zip(*panel.get_legend_handles_labels(), strict=True)
    }
    if lines:
        figure.legend(lines.values(), lines.keys(), loc="outside upper center", ncols=len(lines))
