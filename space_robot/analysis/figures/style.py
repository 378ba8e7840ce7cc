"""Common style of all figures, and writing of their files.

The colours are those of Okabe and Ito, safe for colour-blind readers, without yellow, which is too
pale for lines. Consecutive colours also differ in brightness, and each line has a marker of its
own shape, so that lines can be distinguished in greyscale.
"""

from __future__ import annotations

import textwrap
import warnings
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure, FigureBase
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from space_robot_msgs_py.config.text import shortened
from space_robot_msgs_py.errors import InputError

from ...console.files import atomic_file, make_folder

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

MOST_LETTERS = 40
"""Maximum length of a name in a legend, in characters: the layout of long texts takes minutes."""
RESOLUTION = 150
"""Resolution of a PNG, dpi."""
PAGE_WIDTH = 180.0
"""Width of a page, mm: A4 without margins."""
GREY = "#707070"
COLOURS = ("#000000", "#E69F00", "#0072B2", "#CC79A7", "#009E73", "#56B4E9", "#D55E00")
MARKERS = ("o", "s", "^", "D", "v", "<", "P", ">", "*")
DASHES: tuple[Any, ...] = ("-", "--", "-.", (0, (5, 1, 1, 1, 1, 1)), (0, (8, 2)), (0, (2, 1)))
STRETCHES = 250
"""Number of intervals of a long line, each narrower than the line width."""
MARKS = 4
"""Number of markers per line."""

house_style = partial(
    matplotlib.style.context, Path(__file__).with_name("space_robot.mplstyle"), after_reset=True
)
"""Temporarily applies the style sheet to matplotlib's defaults, ignoring the user's settings."""


class LineStyle(NamedTuple):
    """Colour, marker and dashes of a line."""

    colour: str
    marker: str
    dashes: Any

    @classmethod
    def of(cls, index: int) -> LineStyle:
        """Return the style of the line ``index``; 63 lines have distinct colour and marker."""
        return cls(*(styles[index % len(styles)] for styles in (COLOURS, MARKERS, DASHES)))


def page(height: float, title: str = "") -> Figure:
    """Return an empty page of ``height`` mm, with a title unless it is empty."""
    figure = Figure(figsize=(PAGE_WIDTH / 25.4, height / 25.4), dpi=RESOLUTION)
    if title:
        figure.suptitle(plain(textwrap.fill(shortened(title, 5 * MOST_LETTERS), 95)))
    return figure


def plain(text: str) -> str:
    """Escape ``text`` so that $ does not start a formula."""
    return text.replace("$", r"\$")


def plot_lines(
    axes: Axes,
    x: Array,
    values: Array,
    *,
    looks: Sequence[int] | None = None,
    marks: Indices | None = None,
    dashed: bool = False,
    steps: bool = False,
) -> None:
    """Plot the columns of ``values``, those with the largest variation at the back.

    Args:
        axes: to plot in.
        x: (N,) in the unit of the horizontal axis.
        values: (N, m), one line per column; only finite values are drawn.
        looks: style numbers of the columns; by default 0, 1, ...
        marks: samples with a marker; by default `MARKS` per line, at different samples.
        dashed: use dashes, too; not suitable for lines with chatter.
        steps: draw each value as constant since the previous sample.
    """
    looks = range(values.shape[1]) if looks is None else looks
    wildness = np.array([total_variation(column) for column in values.T])
    for depth, column in enumerate(np.argsort(-wildness, kind="stable").tolist()):
        index, shown = looks[column], _finite(values[:, column])
        look = LineStyle.of(index)
        marked = scattered(len(x), index, max(looks) + 1) if marks is None else marks
        drawn = np.union1d(thinned(shown), marked)
        axes.plot(
            x[drawn],
            shown[drawn],
            color=look.colour,
            linestyle=look.dashes if dashed else "-",
            marker=look.marker,
            markevery=np.searchsorted(drawn, marked).tolist(),
            zorder=2.0 + 0.01 * depth,
            drawstyle="steps-pre" if steps else "default",
        )


def _finite(column: Array) -> Array:
    return np.where(np.isfinite(column), column, np.nan)


def total_variation(column: Array) -> float:
    """Return the way up and down of the finite values of a column."""
    with np.errstate(over="ignore"):
        return float(np.nansum(np.abs(np.diff(_finite(column)))))


def thinned(signal: Array, stretches: int = STRETCHES) -> Indices:
    """Return the indices of minimum and maximum of each of ``stretches`` intervals, and both ends.

    They give the same line as all samples, with half the time and file size: no peak is lost, and
    chatter keeps its full width. NaN is chosen only if an interval has no other values.
    """
    last = len(signal) - 1
    length = -(-len(signal) // stretches)
    if length <= 2:
        return np.arange(len(signal))
    starts = np.arange(0, len(signal), length)
    padded = np.pad(signal, (0, len(starts) * length - len(signal)), mode="edge")
    rows = padded.reshape(-1, length)
    lowest = np.argmin(np.where(np.isnan(rows), np.inf, rows), axis=1)
    highest = np.argmax(np.where(np.isnan(rows), -np.inf, rows), axis=1)
    kept = np.concatenate([[0], starts + lowest, starts + highest, [last]])
    chosen: Indices = np.unique(np.minimum(kept, last))
    return chosen


def scattered(samples: int, index: int, count: int) -> Indices:
    """Return the samples of line ``index`` of ``count`` to mark, different from other lines'."""
    places = (np.arange(MARKS) + (index + 0.5) / count) / MARKS
    return np.unique((places * samples).astype(np.intp))


def plot_spectrum(axes: Axes, frequency: Array, density: Array, index: int, count: int) -> None:
    """Plot a spectrum as line ``index`` of ``count``, for logarithmic axes."""
    look = LineStyle.of(index)
    even = np.geomspace(frequency[0], frequency[-1], 1000)
    axes.plot(
        frequency,
        density,
        color=look.colour,
        linestyle=look.dashes,
        marker=look.marker,
        markevery=np.searchsorted(frequency, even[scattered(1000, index, count)]).tolist(),
    )


def mark_moments(axes: Axes, moments: Array, linestyle: str = ":") -> None:
    """Draw vertical lines at ``moments``, in the unit of the horizontal axis."""
    for moment in moments:
        axes.axvline(moment, color=GREY, linewidth=0.8, linestyle=linestyle, zorder=1.5)


def mark_events(axes: Axes, times: Array) -> None:
    """Draw vertical lines at the ``times`` of captures and releases, s."""
    mark_moments(axes, times, "-")


def legend_above(
    where: Axes | FigureBase, names: Sequence[str], *, dashed: bool, width: float = PAGE_WIDTH - 20
) -> Legend:
    """Draw a legend of lines, in the order of their styles, above a figure or a panel.

    ``dashed``: as in `plot_lines`; ``width``: what is available, mm.
    """
    names = [shortened(name, MOST_LETTERS) for name in names]
    looks = [LineStyle.of(index) for index in range(len(names))]
    handles = [
        Line2D([], [], color=x.colour, marker=x.marker, linestyle=x.dashes if dashed else "-")
        for x in looks
    ]
    options: dict[str, Any] = {"loc": "outside upper left"}
    if isinstance(where, Axes):  # above the exponent of the axis
        options = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 1.5}
    legend = where.legend(handles, ["-"] * len(names), ncols=_columns(names, width), **options)
    for text, name in zip(legend.get_texts(), names, strict=True):
        text.set_text(plain(name))  # matplotlib omits labels that begin with _
    return legend


def _columns(names: Sequence[str], width: float) -> int:
    entries = [11.0 + 1.6 * len(name) for name in names]
    for columns in range(len(names), 1, -1):
        if sum(max(column) for column in np.array_split(entries, columns)) <= width:
            return columns
    return 1


def grid(figure: FigureBase, count: int, columns: int, *, shared: bool = True) -> list[Axes]:
    """Return ``count`` panels in rows of ``columns``; ``shared``: their scales are common."""
    cells = figure.add_gridspec(max(1, -(-count // columns)), columns)
    panels: list[Axes] = []
    for number in range(count):
        first = panels[0] if panels and shared else None
        axes = figure.add_subplot(cells[divmod(number, columns)], sharex=first, sharey=first)
        if shared:
            is_left, is_lowest = number % columns == 0, number + columns >= count
            axes.tick_params(labelleft=is_left, labelbottom=is_lowest)
            axes.yaxis.get_offset_text().set_visible(is_left)
        panels.append(axes)
    return panels


@house_style()
def save_figure(figure: Figure, stem: Path, *, png: bool = True) -> tuple[Path, ...]:
    """Write ``stem``.svg and, if ``png``, ``stem``.png; return the files, the SVG last.

    Equal figures give equal bytes. Existing files are replaced; InputError: they cannot be.
    """
    if not stem.name:
        raise InputError(f"{stem}: is a folder; choose a file name, without suffix")
    make_folder(stem.parent)
    with warnings.catch_warnings():  # characters missing in the font: drawn as boxes
        warnings.filterwarnings("ignore", "Glyph .* missing")
        engine = figure.get_layout_engine()
        if engine and figure.get_axes():
            engine.execute(figure)
            figure.set_layout_engine("none")  # avoids a new layout for each file
        files = []
        metadata = {"png": {"Software": None}, "svg": {"Date": None, "Creator": None}}
        for format in ("png", "svg") if png else ("svg",):
            path = stem.with_name(f"{stem.name}.{format}")
            with atomic_file(path, replace=True) as file:
                figure.savefig(file, format=format, dpi=RESOLUTION, metadata=metadata[format])
            files.append(path)
    return tuple(files)
