"""What all pictures share: the page in mm, type sizes, and looks that survive grey print.

Colours are those of Okabe and Ito, safe for the colour-blind, without their yellow, which is too
pale for a line. They are ordered so that neighbours differ in brightness too, and every line has a
marker of its own shape.
"""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

PAGE_WIDTH = 180.0
"""mm; A4 less its margins."""
LEFT, RIGHT = 18.0, 3.0
"""mm, the margins of the page; the left one holds an axis label and its numbers."""
TITLE_LINE, LEGEND_LINE, TIME_AXIS = 4.2, 4.6, 11.5
"""mm, the heights of a line of title, a row of legend, and a time axis with its label."""
_LABEL_LEFT, _LABEL_BELOW = 16.5, 9.2
"""mm, the outer edges of the axis labels from the axes: the same for all, so that they align."""

GREY, GRID = "#707070", "#E4E4E4"
COLOURS = ("#000000", "#E69F00", "#0072B2", "#CC79A7", "#009E73", "#56B4E9", "#D55E00")
MARKERS = ("o", "s", "^", "D", "v", "<", "P", ">", "*")
DASHES: tuple[Any, ...] = ("-", "--", "-.", (0, (5, 1, 1, 1, 1, 1)), (0, (8, 2)), (0, (2, 1)))

_SETTINGS: Any = {
    "font.family": "DejaVu Sans",  # comes with matplotlib
    "text.parse_math": False,  # a $ in a name is a $
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "figure.titlesize": 9.0,
    "figure.titleweight": "bold",
    "axes.linewidth": 0.6,
    "axes.labelpad": 2.0,
    "axes.titlepad": 3.0,
    "axes.titley": 1.0,  # else each title looks for a place of its own, which takes time
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.xmargin": 0.01,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-30, 30),
    "grid.color": GRID,
    "grid.linewidth": 0.5,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "lines.linewidth": 0.9,
    "lines.markersize": 3.6,
    "lines.markeredgewidth": 0.7,
    "lines.markerfacecolor": "white",
    "legend.frameon": False,
    "legend.borderpad": 0.0,
    "legend.borderaxespad": 0.2,
    "legend.handlelength": 2.2,
    "legend.handletextpad": 0.5,
    "legend.columnspacing": 1.2,
    "legend.labelspacing": 0.3,
    "path.simplify_threshold": 0.3,
    "svg.hashsalt": "space_robot",  # else the names in an SVG are drawn by lot
}


class Look(NamedTuple):
    """How one of several lines is told from the others."""

    colour: str
    marker: str
    dashes: Any

    @classmethod
    def of(cls, index: int) -> Look:
        """The look of the line ``index``: no two of 63 share colour and marker."""
        return cls(
            COLOURS[index % len(COLOURS)],
            MARKERS[index % len(MARKERS)],
            DASHES[index % len(DASHES)],
        )


@contextmanager
def house_style() -> Iterator[None]:
    """These settings and matplotlib's defaults, not the user's; put back afterwards."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS)
        yield


def page(height: float, title: str = "") -> Figure:
    """A page of ``height`` mm with its title at the top."""
    figure = Figure(figsize=(PAGE_WIDTH / 25.4, height / 25.4))
    if title:
        figure.suptitle(wrapped(title), x=0.5, y=1.0 - 1.5 / height, va="top")
    return figure


def wrapped(title: str) -> str:
    """``title`` in lines that fit the page."""
    return textwrap.fill(title, 95)


def title_height(title: str) -> float:
    """Mm that ``title`` takes at the top of a page."""
    return 2.0 + TITLE_LINE * (wrapped(title).count("\n") + 1) if title else 1.0


def panel(figure: Figure, left: float, top: float, width: float, height: float) -> Axes:
    """Axes of a size in mm at a place in mm, from the upper left corner of the page."""
    x, y = _share(figure, left, top + height)
    page_width, page_height = 25.4 * figure.get_size_inches()
    axes = figure.add_axes((x, y, width / page_width, height / page_height))
    axes.yaxis.set_label_coords(-_LABEL_LEFT / width, 0.5)
    axes.yaxis.label.set_verticalalignment("top")
    axes.xaxis.set_label_coords(0.5, -_LABEL_BELOW / height)
    axes.xaxis.label.set_verticalalignment("bottom")
    return axes


def legend_columns(names: Sequence[str], width: float) -> int:
    """Columns in which the legend of ``names`` fits into ``width`` mm."""
    entries = [11.0 + 1.5 * len(name) for name in names]
    for columns in range(len(names), 1, -1):
        if sum(max(column) for column in np.array_split(entries, columns)) <= width:
            return columns
    return 1


def legend_height(names: Sequence[str], width: float) -> float:
    """Mm that the legend of ``names`` takes."""
    return LEGEND_LINE * math.ceil(len(names) / legend_columns(names, width))


def legend_above(
    figure: Figure, left: float, top: float, names: Sequence[str], width: float, *, dashed: bool
) -> None:
    """Name the lines just above what begins ``top`` mm down, where the legend hides nothing."""
    looks = [Look.of(index) for index in range(len(names))]
    handles = [
        Line2D([], [], color=x.colour, marker=x.marker, linestyle=x.dashes if dashed else "-")
        for x in looks
    ]
    legend = figure.legend(
        handles, ["-"] * len(names), loc="lower left", bbox_to_anchor=_share(figure, left, top),
        ncols=legend_columns(names, width),
    )  # fmt: skip
    for text, name in zip(legend.get_texts(), names, strict=True):
        text.set_text(name)  # a label that begins with _ would be left out


def _share(figure: Figure, left: float, top: float) -> tuple[float, float]:
    """A place in mm from the upper left corner, in shares of the page from the lower left one."""
    width, height = 25.4 * figure.get_size_inches()
    return float(left / width), float(1.0 - top / height)
