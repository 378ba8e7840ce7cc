"""The rows of a sweep summed up: medians and spread, as tables and as a figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ...analysis.figures.style import LineStyle, grid, house_style, legend_above, page, plain
from ...console.tables import Column, Group, Table
from ..report.quantities import ERRORS, FAST, RIPPLE, Quantity, of_metric
from ..row.row import Row
from ..study import Law
from .study import ACTUATORS, SENSORS

FAST_OF_BASE = f"{FAST}base_torque"


class SweepCell(NamedTuple):
    """All flights of a law with some sensors and actuators."""

    law: Law
    sensors: str
    actuators: str
    flights: int
    failed: int
    metrics: dict[str, tuple[float, float, float]]
    """5 %, 50 % and 95 % of those that did not fail, by name; none if all did."""


def shown(swept: Sequence[SweepCell]) -> list[str]:
    """Return the metrics that tables show: RMS errors, then ripple."""
    names = list(dict.fromkeys(name for cell in swept for name in cell.metrics))
    ripples = [name for name in names if name.startswith(RIPPLE)]
    if FAST_OF_BASE in names:  # beside what it is a share of
        ripples.insert(1, FAST_OF_BASE)
    return _errors(names) + ripples


def drawn(swept: Sequence[SweepCell]) -> list[str]:
    """Return the metrics that a figure shows: of the base, then of the outermost joints."""
    names = shown(swept)
    errors, ripples = _errors(names), [name for name in names if name.startswith(RIPPLE)]
    return list(dict.fromkeys([*errors[:1], *ripples[:1], *errors[-1:], *ripples[-1:]]))


def _errors(names: Sequence[str]) -> list[str]:
    return [name for name in names if name.startswith(ERRORS) and name.endswith("_rms")]


def cells(rows: Sequence[Row]) -> list[SweepCell]:
    """Sum up the rows by hardware and law, in their order."""
    swept: dict[tuple[Law, str, str], list[Row]] = {}
    for row in rows:
        law, (sensors, actuators) = Law.parse(row.task.law), hardware_of(row)
        swept.setdefault((law, sensors, actuators), []).append(row)
    return [_cell(*key, own) for key, own in swept.items()]


def hardware_of(row: Row) -> tuple[str, str]:
    """Return sensors and actuators of a flight."""
    return str(row.vary[SENSORS]), str(row.vary[ACTUATORS])


def row_record(row: Row) -> dict[str, Any]:
    """Return a flight and what came of it as a flat dictionary."""
    law, (sensors, actuators) = Law.parse(row.task.law), hardware_of(row)
    return {
        "run": row.task.run,
        "controller": law.controller,
        "gains": law.gains,
        "sensors": sensors,
        "actuators": actuators,
        "failure": row.reason,
        **row.metrics,
    }


def _cell(law: Law, sensors: str, actuators: str, rows: Sequence[Row]) -> SweepCell:
    flown = [row.metrics for row in rows if row.is_complete]
    metrics = {}
    for name in flown[0] if flown else ():
        low, middle, high = np.quantile([m[name] for m in flown], (0.05, 0.5, 0.95)).tolist()
        metrics[name] = low, middle, high
    return SweepCell(law, sensors, actuators, len(rows), len(rows) - len(flown), metrics)


def hardware(swept: Sequence[SweepCell]) -> dict[str, list[str]]:
    """Return what the cells fly with, a value a cell: sensors, actuators, or both, unless ideal."""
    named = {
        "sensors": [cell.sensors for cell in swept],
        "actuators": [cell.actuators for cell in swept],
    }
    varied = {key: values for key, values in named.items() if set(values) != {"ideal"}}
    return varied or {"sensors": named["sensors"]}


def summary_table(swept: Sequence[SweepCell]) -> Table:
    """Tabulate the medians, a group for every hardware."""
    flown_with, metrics_shown = hardware(swept), [of_metric(name) for name in shown(swept)]
    columns = (
        Column("law", is_label=True),
        Column("gains", is_label=True),
        *(Column(_short(metric), metric.unit, ".2g") for metric in metrics_shown),
        Column("failed"),
    )
    groups: dict[tuple[str, ...], list[list[Any]]] = {}
    for cell, *names in zip(swept, *flown_with.values(), strict=True):
        middles = [
            cell.metrics[m.name][1] if m.name in cell.metrics else None for m in metrics_shown
        ]
        row = [cell.law.controller, cell.law.gains, *middles, f"{cell.failed} of {cell.flights}"]
        groups.setdefault(tuple(names), []).append([*names, *row])
    return Table(
        "Medians of errors and ripple",
        (*(Column(name, is_label=True) for name in flown_with), *columns),
        [Group(rows) for rows in groups.values()],
    )


def _short(metric: Quantity) -> str:
    """Shorten a heading, for there are many columns."""
    if metric.name == FAST_OF_BASE:
        return "> 25 Hz"
    kind, _, column = metric.heading.partition(", ")
    return kind if column == "RMS" else f"{kind} {column.replace('torque', '').strip()}"


def as_records(swept: Sequence[SweepCell]) -> list[dict[str, Any]]:
    """Return a dictionary a cell, ready for JSON."""
    return [
        {
            "controller": cell.law.controller,
            "gains": cell.law.gains,
            "sensors": cell.sensors,
            "actuators": cell.actuators,
            "flights": cell.flights,
            "failed": cell.failed,
            "metrics": {
                name: dict(zip(("low", "median", "high"), values, strict=True))
                for name, values in cell.metrics.items()
            },
        }
        for cell in swept
    ]


@house_style()
def figure(swept: Sequence[SweepCell]) -> Figure:
    """Draw errors (left) and ripple (right) of every law by hardware; bars from 5 % to 95 %."""
    titles = [", ".join(map(plain, names)) for names in zip(*hardware(swept).values(), strict=True)]
    kinds = list(dict.fromkeys(titles))
    laws = list(dict.fromkeys(cell.law for cell in swept))
    if not (names := drawn(swept)):
        return page(12.0, "None of these flights came to its end.")
    sheet = page(130.0)
    legend_above(sheet, [law.title for law in laws], dashed=False)
    for axes, name in zip(grid(sheet, len(names), 2, shared=False), names, strict=True):
        for number, law in enumerate(laws):
            look, shift = LineStyle.of(number), 0.09 * (number - 0.5 * (len(laws) - 1))
            own = [
                (kinds.index(title) + shift, c.metrics[name])
                for title, c in zip(titles, swept, strict=True)
                if c.law == law and name in c.metrics
            ]
            places = [place for place, _ in own]
            low, middle, high = np.array([values for _, values in own]).reshape(-1, 3).T
            axes.errorbar(
                places,
                middle,
                yerr=(middle - low, high - middle),
                color=look.colour,
                marker=look.marker,
                linestyle="none",
                markersize=4,
            )
        axes.set_yscale("log")
        axes.set_ylabel(of_metric(name).label)
        axes.set_xticks(range(len(kinds)), kinds)
        axes.set_xlim(-0.5, len(kinds) - 0.5)
    return sheet
