"""Recorded and replayed torques as CSV file and as figure."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from ..analysis.figures.style import (
    grid,
    house_style,
    legend_above,
    page,
    plain,
    plot_lines,
    save_figure,
)
from ..console.files import csv_rows, csv_writer
from ..flight.replay.comparison import Comparison

COLUMNS = 3


def write_csv(comparison: Comparison, period: float, path: Path) -> None:
    """Write a row per tick: tick, time in s, torque of each axis in N m or N."""
    ticks, recorded, replayed = comparison.table()
    names = [
        f"{axis}_{which}" for which in ("recorded", "replayed") for axis in comparison.axis_names
    ]
    numbers = np.column_stack([(ticks * period).round(9), recorded, replayed])
    with csv_writer(path, replace=True) as writer:
        writer.writerow(["tick", "time_s", *names])
        writer.writerows(csv_rows(ticks, numbers))


def write_plot(comparison: Comparison, period: float, title: str, path: Path) -> tuple[Path, ...]:
    """Draw PNG and SVG files named as ``path``; return the files."""
    return save_figure(torques(comparison, period, title), path.with_suffix(""))


@house_style()
def torques(comparison: Comparison, period: float, title: str) -> Figure:
    """Plot the recorded and the replayed torque of every axis over time."""
    ticks, recorded, replayed = comparison.table()
    time, names = ticks.astype(np.float64) * period, comparison.axis_names
    rows = math.ceil(len(names) / COLUMNS)
    figure = page(14.0 + 48.0 * rows, title)
    panels = grid(figure, len(names), COLUMNS, shared=False)
    for index, (axes, name) in enumerate(zip(panels, names, strict=True)):
        both = np.column_stack([recorded[:, index], replayed[:, index]])
        plot_lines(axes, time, both, dashed=True)
        axes.set_title(plain(name))
        unit = comparison.units[index]
        axes.set(xlabel="time (s)", ylabel="force (N)" if unit == "N" else f"torque ({unit})")
    legend_above(figure, ("recorded", "replayed"), dashed=True)
    return figure
