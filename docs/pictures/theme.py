"""The theme of the pictures: one SVG that is light or dark as the page that shows it.

Matplotlib draws with sentinel colours. `write` replaces them by variables of a style sheet in the
SVG, which has their values for both schemes. So pictures have the colours below only.
"""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter
from numpy.typing import NDArray

Array = NDArray[np.float64]
Point = tuple[float, float]

FOLDER = Path(__file__).parent
WIDTH = 6.4  # inches
COLOURS = {
    "ink": ("#1b1f24", "#e6e9ee"),
    "muted": ("#57606a", "#a3abb8"),
    "grid": ("#d8dee4", "#3b424d"),
    "background": ("#ffffff", "#1e2129"),
    "blue": ("#0072b2", "#56b4e9"),
    "orange": ("#c44e00", "#f59042"),
    "green": ("#00795a", "#35c199"),
    "purple": ("#a8408a", "#e58cc6"),
}
"""Light and dark, the series after Okabe and Ito: the colour-blind tell them apart as well."""
INK, MUTED, GRID, BACKGROUND, *SERIES = (f"#0a0b{number:02d}" for number in range(1, 9))
BLUE, ORANGE, GREEN, PURPLE = SERIES
FONTS = "text{font-family:system-ui,'Segoe UI',Roboto,'Helvetica Neue',Arial,sans-serif}"

mpl.rcParams.update(mpl.rc_params_from_file(FOLDER / "theme.mplstyle", use_default_template=False))
PICTURES: dict[str, Callable[[], Figure]] = {}


def picture(function: Callable[[], Figure]) -> Callable[[], Figure]:
    """Register a function that draws the picture of its name."""
    PICTURES[function.__name__] = function
    return function


def panels(count: int = 1, height: float = 3.8, **options: Any) -> tuple[Figure, list[Axes]]:
    """Return a figure and its panels, one above the other; ``height`` in inches."""
    figure = Figure(figsize=(WIDTH, height))
    return figure, list(figure.subplots(count, 1, squeeze=False, **options)[:, 0])


def drawing(x: float, y: float) -> tuple[Figure, Axes]:
    """Return a figure with one panel of equal scales, without axes, from 0 to x and 0 to y."""
    figure, (axes,) = panels(height=WIDTH * y / x)
    axes.set(xlim=(0, x), ylim=(0, y), aspect="equal")
    axes.axis("off")
    return figure, axes


def box(axes: Axes, place: Point, text: str, size: Point, color: str) -> None:
    """Draw a box about its centre."""
    corner, shape = (place[0] - 0.5 * size[0], place[1] - 0.5 * size[1]), "round,pad=0"
    patch = mpl.patches.FancyBboxPatch(corner, *size, boxstyle=f"{shape},rounding_size=0.12")
    axes.add_patch(patch).set(edgecolor=color, facecolor="none", linewidth=1.8)
    axes.text(*place, text, ha="center", va="center", linespacing=1.35)


def arrow(axes: Axes, *points: Point, color: str = INK) -> None:
    """Draw a line through points, with a head at the last."""
    axes.plot(*np.array(points[:-1]).T, color=color, linewidth=1.5)
    style = {"arrowstyle": "-|>", "shrinkA": 0, "shrinkB": 0, "color": color, "linewidth": 1.5}
    axes.annotate("", points[-1], points[-2], arrowprops=style)


def powers(*scales: Axis) -> None:
    """Make scales logarithmic, with ticks such as 10⁻⁶."""
    raised = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

    def text(value: float, _: int) -> str:
        return "10" + str(round(np.log10(value))).translate(raised)

    for scale in scales:
        is_x = scale is scale.axes.xaxis
        scale.axes.set(**{"xscale" if is_x else "yscale": "log"})
        scale.set_major_formatter(FuncFormatter(text))
        scale.set_minor_formatter("")


def thinned(time: Array, values: Array, count: int = 350) -> tuple[Array, Array]:
    """Return a curve's least and largest value of each of ``count`` stretches, in their order."""
    size = max(1, len(time) // count)
    rows = len(time) // size
    parts = values[: rows * size].reshape(rows, size)
    picks = np.sort(np.column_stack((parts.argmin(axis=1), parts.argmax(axis=1))), axis=1)
    places = (picks + size * np.arange(rows)[:, None]).ravel()
    return time[places], values[places]


def curves(axes: Axes, time: Array, values: Mapping[str, Array]) -> None:
    """Draw curves (N,); the names of several stand above the panel."""
    for (name, curve), color in zip(values.items(), SERIES, strict=False):
        axes.plot(*thinned(time, curve), color=color, label=name)
    if len(values) > 1:
        legend(axes)


def legend(axes: Axes) -> None:
    """Put the names of what is drawn above the panel."""
    count = len(axes.get_legend_handles_labels()[1])
    axes.legend(ncols=count, loc="lower left", bbox_to_anchor=(0.0, 0.98))


def block(page: str, name: str) -> str:
    """Return the block of a page that begins with a file's name."""
    text = (FOLDER.parent / page).read_text("utf-8")
    return text[text.index(f"\n# {name}\n") :].split("```")[0]


def write(name: str) -> Path:
    """Draw a picture and write its SVG into this folder."""
    path = FOLDER / f"{name}.svg"
    path.write_text(as_svg(PICTURES[name]()), "utf-8")
    return path


def as_svg(figure: Figure) -> str:
    """Return a figure as SVG, with colours for both schemes."""
    file = io.StringIO()
    figure.savefig(file, format="svg")
    text = re.sub(r"<metadata>.*?</metadata>", "", file.getvalue(), flags=re.DOTALL)
    text = re.sub(r"<[^>]*>", _shortened, text)
    for number, colour in enumerate(COLOURS, start=1):
        text = text.replace(f"#0a0b{number:02d}", f"var(--{colour})")
    light, dark = (
        "svg{" + "".join(f"--{colour}:{pair[k]};" for colour, pair in COLOURS.items()) + "}"
        for k in (0, 1)
    )
    style = f"<style>{FONTS}{light}@media (prefers-color-scheme:dark){{{dark}}}</style>"
    return re.sub(r"(<svg [^>]*>)", rf"\1\n{style}", text, count=1)


def _shortened(tag: re.Match[str]) -> str:
    # texts stay as they are: only coordinates and fonts within a tag
    text = re.sub(r"\d+\.\d{3,}", lambda number: f"{float(number[0]):.2f}", tag[0])
    return re.sub(r"; font-family: [^;]*", "", text)
