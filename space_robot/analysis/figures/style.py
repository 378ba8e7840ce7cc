"""Common style of all figures, and writing of their files.

The colours are those of Okabe and Ito, safe for colour-blind readers, without yellow, which is too
pale for lines. Consecutive colours also differ in brightness, and each line has dashes and markers
of its own, so that lines can be distinguished in greyscale. Where there are more samples than
pixels, a line is the mean of each pixel's samples, in an envelope from their minimum to their
maximum.
"""

from __future__ import annotations

import io
import math
import re
import textwrap
import warnings
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
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

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.config.text import shortened
from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import InputError

from ...console.files import atomic_file, make_folder

Indices = NDArray[np.intp]

MOST_LETTERS = 40
"""Maximum length of a name in a legend, in characters: the layout of long texts takes minutes."""
RESOLUTION = 150
"""Resolution of a PNG, dpi."""
PAGE_WIDTH = 180.0
"""Width of a page, mm: A4 without margins."""
WIDTHS = {"single": 88.9, "double": 181.9}
"""Widths of one and of two columns of IEEE's journals, mm."""
NARROW_PAGE = 120.0
"""Width, mm, below which panels stand below one another."""
NO_DATES = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}
"""Formats of files, with metadata that are the same at any time."""
NEAR_LIMIT = 2.0
"""Multiple of the largest value up to which a limit is drawn, instead of written."""
GREY = "#707070"
COLOURS = ("#000000", "#E69F00", "#0072B2", "#CC79A7", "#009E73", "#56B4E9", "#D55E00")
MARKERS = ("o", "s", "^", "D", "v", "<", "P", ">", "*")
DASHES: tuple[Any, ...] = ("-", "--", "-.", (0, (5, 1, 1, 1, 1, 1)), (0, (8, 2)), (0, (2, 1)))
PATH, DIGITS = re.compile(rb' d="[^"]*"'), re.compile(rb"(\.\d\d)\d+")
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


def parse_width(width: str | float) -> float:
    """Return the width of a figure in mm, from one of `WIDTHS` or a number of mm.

    Raises:
        InputError: it is neither, or out of range.
    """
    mm = math.nan
    with suppress(TypeError, ValueError):
        mm = float(WIDTHS.get(str(width), width))
    if not 60.0 <= mm <= 500.0:
        raise InputError(f"width {short(width)}: {', '.join(WIDTHS)}, or 60 to 500 mm expected")
    return mm


def page(height: float, title: str = "", width: float = PAGE_WIDTH) -> Figure:
    """Return an empty page of ``height`` and ``width`` mm, with a title unless it is empty."""
    figure = Figure(figsize=(width / 25.4, height / 25.4), dpi=RESOLUTION)
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

    With more than two samples a pixel, each is the mean in an envelope from minimum to maximum.

    Args:
        axes: to plot in.
        x: (N,) in the unit of the horizontal axis.
        values: (N, m), one line per column; only finite values are drawn.
        looks: style numbers of the columns; by default 0, 1, ...
        marks: samples with a marker; by default `MARKS` per line, at different samples.
        dashed: use dashes, too; envelopes always do. Not suitable for lines with chatter.
        steps: draw each value as constant since the previous sample.
    """
    looks = range(values.shape[1]) if looks is None else looks
    wildness = np.array([total_variation(column) for column in values.T])
    length = -(-len(x) // max(1, int(axes.get_window_extent().width)))
    is_long = length > 2
    if is_long:
        ends = x[[0, -1]]
        x, low, values, high = binned(x, values, length)
        x[[0, -1]] = ends
        marks = None if marks is None else np.minimum(marks // length, len(x) - 1)
    for depth, column in enumerate(np.argsort(-wildness, kind="stable").tolist()):
        look, zorder = LineStyle.of(looks[column]), 2.0 + 0.01 * depth
        if is_long:
            area = axes.fill_between(x, low[:, column], high[:, column], color=look.colour)
            area.set(alpha=0.3, linewidth=0.3, zorder=zorder - 0.3)
        marked = scattered(len(x), looks[column], max(looks) + 1) if marks is None else marks
        axes.plot(
            x,
            _finite(values[:, column]),
            color=look.colour,
            linestyle=look.dashes if dashed or is_long else "-",
            marker=look.marker,
            markevery=marked.tolist(),
            zorder=zorder,
            drawstyle="steps-pre" if steps else "default",
        )


def binned(x: Array, values: Array, length: int) -> tuple[Array, Array, Array, Array]:
    """Return places, minima, means and maxima of each ``length`` samples, and of those left over.

    Values that are not finite are left out; NaN: there is no other.
    """
    starts = np.arange(0, len(x), length)
    values = _finite(values)
    counts = np.add.reduceat(np.isfinite(values), starts, axis=0, dtype=np.float64)
    counts[counts == 0.0] = np.nan
    with np.errstate(over="ignore", invalid="ignore"):
        means = np.add.reduceat(np.nan_to_num(values), starts, axis=0) / counts
    low, high = (f.reduceat(values, starts, axis=0) for f in (np.fmin, np.fmax))
    return x[np.minimum(starts + length // 2, len(x) - 1)], low, means, high


def _finite(values: Array) -> Array:
    return np.where(np.isfinite(values), values, np.nan)


def total_variation(column: Array) -> float:
    """Return the way up and down of the finite values of a column."""
    with np.errstate(over="ignore"):
        return float(np.nansum(np.abs(np.diff(_finite(column)))))


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


def mark_limits(axes: Axes, limits: Sequence[float], values: Array) -> None:
    """Draw limits of either sign as lines; those far beyond the values are written above."""
    largest, is_log = np.nanmax(np.abs(values), initial=0.0), axes.get_yscale() == "log"
    near = sorted({limit for limit in limits if 0.0 < limit <= NEAR_LIMIT * largest})
    for limit in near:
        for side in (limit,) if is_log else (-limit, limit):
            axes.axhline(side, color=GREY, linewidth=0.8, linestyle=":", zorder=1.5)
    if far := sorted({limit for limit in limits if limit} - {*near}):
        text = f"limit {', '.join(f'{limit:g}' for limit in far)}"
        axes.set_title(text, loc="right", color=GREY)


def legend_inside(
    axes: Axes, names: Sequence[str], *, dashed: bool, looks: Sequence[int] | None = None
) -> None:
    """Draw a legend of lines in the emptiest part of a panel; above it if it would cover a line."""
    place = {"loc": "best", "borderaxespad": 0.8, "frameon": True, "edgecolor": "none"}
    legend = _legend_of(axes, names, dashed, looks, place)
    assert isinstance(axes.figure, Figure)
    axes.figure.draw_without_rendering()
    box = legend.get_window_extent().padded(2.0)
    drawn = [x.get_path() for x in axes.get_lines() if x.get_transform() is axes.transData]
    drawn += [path for area in axes.collections for path in area.get_paths()]
    if any(path.transformed(axes.transData).intersects_bbox(box, filled=False) for path in drawn):
        legend.remove()
        legend_above(axes, names, dashed=dashed, looks=looks)


def legend_above(
    where: Axes | FigureBase,
    names: Sequence[str],
    *,
    dashed: bool,
    looks: Sequence[int] | None = None,
) -> Legend:
    """Draw a legend of lines, which look as in `plot_lines`, above a figure or a panel."""
    above_exponent = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "borderaxespad": 1.5}
    place = above_exponent if isinstance(where, Axes) else {"loc": "outside upper left"}
    return _legend_of(where, names, dashed, looks, place)


def _legend_of(
    where: Axes | FigureBase,
    names: Sequence[str],
    dashed: bool,
    looks: Sequence[int] | None,
    place: Mapping[str, Any],
) -> Legend:
    names = [shortened(name, MOST_LETTERS) for name in names]
    handles = [
        Line2D([], [], color=x.colour, marker=x.marker, linestyle=x.dashes if dashed else "-")
        for x in map(LineStyle.of, range(len(names)) if looks is None else looks)
    ]
    margin = 0.0 if isinstance(where, Axes) else 20.0
    width = where.get_window_extent().width / RESOLUTION * 25.4 - margin
    legend = where.legend(handles, ["-"] * len(names), ncols=_columns(names, width), **place)
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
def save_figure(
    figure: Figure, stem: Path, formats: Collection[str] = ("png", "svg")
) -> tuple[Path, ...]:
    """Write ``stem`` as some of png, svg, pdf; return the files in that order.

    Equal figures give equal bytes. Existing files are replaced.

    Raises:
        InputError: a file cannot be written, or a format is unknown.
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
        for format in formats:
            path, written = stem.with_name(f"{stem.name}.{format}"), io.BytesIO()
            metadata = NO_DATES[one_of(format, NO_DATES, "format")]
            figure.savefig(written, format=format, dpi=RESOLUTION, metadata=metadata)
            content = written.getvalue()
            if format == "svg":  # paths rounded to 0.01 points have half the size
                content = PATH.sub(lambda path: DIGITS.sub(rb"\1", path[0]), content)
            with atomic_file(path, replace=True) as file:
                file.write(content)
            files.append(path)
    return tuple(files)
