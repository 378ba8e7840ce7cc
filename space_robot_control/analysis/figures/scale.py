"""Grid, tick marks and numbers of a panel, drawn as a whole.

They look like matplotlib's and stand at the same places, but matplotlib makes five objects of
every tick, which takes more time than all else in a picture.
"""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.patches import PathPatch
from matplotlib.path import Path
from matplotlib.ticker import NullLocator
from numpy.typing import NDArray

from .style import GRID

Array = NDArray[np.float64]

_TICK, _NUMBER = 3.5, 7.0
"""Points from the axes to the end of a tick mark, and to its number."""


def draw_scales(axes: Axes, *, x_numbers: bool = True, y_numbers: bool = True) -> None:
    """Draw both scales of ``axes``, whose contents and limits do not change any more."""
    axes.set_xlim(axes.get_xlim())  # found with the locators, which go
    axes.set_ylim(axes.get_ylim())
    inches = axes.bbox.transformed(axes.figure.dpi_scale_trans.inverted())
    _draw_scale(axes, axes.xaxis, 72.0 * inches.height, x_numbers)
    _draw_scale(axes, axes.yaxis, 72.0 * inches.width, y_numbers)


def _draw_scale(axes: Axes, axis: Axis, depth: float, numbers: bool) -> None:
    """One of them; ``depth`` is the size of the panel across it, points."""
    low, high = sorted(axis.get_view_interval())
    places = np.asarray(axis.get_majorticklocs())
    seen = places[(places >= low) & (places <= high)]
    texts = axis.get_major_formatter().format_ticks(seen.tolist())
    axis.set_major_locator(NullLocator())
    horizontal = axis is axes.xaxis
    across = axes.get_xaxis_transform() if horizontal else axes.get_yaxis_transform()
    for begin, end, width, colour, order in (
        (0.0, 1.0, 0.5, GRID, 0.5), (0.0, -_TICK / depth, 0.6, "black", 0.6),
    ):  # fmt: skip
        comb = PathPatch(
            _comb(seen, begin, end, horizontal), transform=across, clip_on=False,
            edgecolor=colour, linewidth=width, fill=False, zorder=order, capstyle="butt",
        )  # fmt: skip
        axes.add_artist(comb)
    if not numbers:
        return
    offset = -_NUMBER / depth
    for place, text in zip(seen.tolist(), texts, strict=True):
        x, y = (place, offset) if horizontal else (offset, place)
        axes.text(
            x, y, text, transform=across,
            ha="center" if horizontal else "right", va="top" if horizontal else "center_baseline",
        )  # fmt: skip


def _comb(places: Array, begin: float, end: float, horizontal: bool) -> Path:
    """A stroke at each place, from ``begin`` to ``end`` across."""
    along = np.repeat(places, 2)
    across = np.tile([begin, end], len(places))
    vertices = np.column_stack([along, across] if horizontal else [across, along])
    return Path(vertices, np.tile([Path.MOVETO, Path.LINETO], len(places)))
