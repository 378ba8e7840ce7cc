"""Recorded and replayed torques as files: a table for other tools, a picture for people."""

from __future__ import annotations

import csv
import io
import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..analysis.export import whole_file
from ..analysis.figures.files import save_figure
from ..analysis.figures.lines import draw_lines
from ..analysis.figures.quantity import Quantity
from ..analysis.figures.scale import draw_scales
from ..analysis.figures.style import (
    LEFT,
    LEGEND_LINE,
    PAGE_WIDTH,
    RIGHT,
    TIME_AXIS,
    house_style,
    legend_above,
    page,
    panel,
    title_height,
)
from ..flight.replay.comparison import Comparison

COLUMNS = 3
_WIDTH = (PAGE_WIDTH - COLUMNS * (LEFT + RIGHT)) / COLUMNS
_HEIGHT, _NAME = 34.0, 5.0


def write_csv(comparison: Comparison, period: float, path: Path) -> None:
    """One row a tick: tick, time in s, and of each axis the torques, N m (empty: no command)."""
    ticks, recorded, replayed = comparison.table()
    names = [
        f"{axis}_{which}" for which in ("recorded", "replayed") for axis in comparison.axis_names
    ]
    with (
        whole_file(path, replace=True) as raw,
        io.TextIOWrapper(raw, encoding="utf-8", newline="") as file,
    ):
        writer = csv.writer(file)
        writer.writerow(["tick", "time_s", *names])
        for tick, row in zip(ticks.tolist(), np.hstack([recorded, replayed]), strict=True):
            torques = ["" if math.isnan(value) else value for value in row.tolist()]
            writer.writerow([tick, round(tick * period, 9), *torques])


def write_plot(comparison: Comparison, period: float, title: str, path: Path) -> tuple[Path, ...]:
    """``path`` as PNG and as SVG, whatever its ending; the files."""
    return save_figure(torques(comparison, period, title), path.with_suffix(""))


@house_style()
def torques(comparison: Comparison, period: float, title: str) -> Figure:
    """Recorded and replayed torque of every axis over time."""
    ticks, recorded, replayed = comparison.table()
    time, names = ticks.astype(np.float64) * period, comparison.axis_names
    top = title_height(title) + LEGEND_LINE
    row_height = _NAME + _HEIGHT + TIME_AXIS
    figure = page(top + row_height * math.ceil(len(names) / COLUMNS), title)
    legend_above(figure, LEFT, top, ("recorded", "replayed"), PAGE_WIDTH - LEFT, dashed=True)
    for index, name in enumerate(names):
        row, column = divmod(index, COLUMNS)
        left = LEFT + column * (LEFT + RIGHT + _WIDTH)
        axes = panel(figure, left, top + row * row_height + _NAME, _WIDTH, _HEIGHT)
        both = np.column_stack([recorded[:, index], replayed[:, index]])
        draw_lines(axes, time, both, Quantity.of(both, "torque", "N m"), dashed=True)
        axes.set_title(name)
        axes.set_xlabel("time (s)")
        draw_scales(axes)
    return figure
