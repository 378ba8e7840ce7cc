"""The rows of a sweep summed up: medians and spread, as tables and as a figure."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from ...analysis.figures.overlay import words
from ...analysis.figures.style import Look, grid, house_style, legend_above, page, plain
from ...analysis.metrics import unit_of
from ...analysis.tables import Column, Group, Table
from ..study import Law
from .run import Row

ERRORS, RIPPLE, FAST = ("attitude", "joints_"), "ripple_", "fast_ripple_base_torque"
"""Beginnings of the names of metrics that tables show."""


class Cell(NamedTuple):
    """All flights of a law with some sensors and actuators."""

    law: Law
    sensors: str
    actuators: str
    flights: int
    failed: int
    metrics: dict[str, tuple[float, float, float]]
    """5 %, 50 % and 95 % of those that did not fail, by name; none if all did."""


def shown(found: Sequence[Cell]) -> dict[str, tuple[str, str]]:
    """Return heading and unit of the metrics that tables show, by name: errors, then ripple."""
    names = list(dict.fromkeys(name for cell in found for name in cell.metrics))
    errors = [name for name in names if name.startswith(ERRORS)]
    ripples = [name for name in names if name.startswith(RIPPLE) or name == FAST]
    if FAST in ripples:  # beside what it is a share of
        ripples.remove(FAST)
        ripples.insert(1, FAST)
    return {
        **{name: (words(name), unit_of(name).strip("-")) for name in errors},
        **{name: (_ripple_of(name), unit_of(name.split(RIPPLE)[1])) for name in ripples},
    }


def drawn(found: Sequence[Cell]) -> list[str]:
    """Return the metrics that a figure shows: of the base, then of the outermost joints."""
    names = list(shown(found))
    errors = [name for name in names if name.startswith(ERRORS)]
    ripples = [name for name in names if name.startswith(RIPPLE)]
    return list(dict.fromkeys([*errors[:1], *ripples[:1], *errors[-1:], *ripples[-1:]]))


def _ripple_of(name: str) -> str:
    if name == FAST:
        return "> 25 Hz"
    column = name.removeprefix(RIPPLE)
    return "base ripple" if column == "base_torque" else f"ripple {words(column).split(' ')[1]}"


def cells(rows: Sequence[Row]) -> list[Cell]:
    """Sum up the rows by hardware and law, in their order."""
    found: dict[tuple[Law, str, str], list[Row]] = {}
    for row in rows:
        law, sensors, _, actuators = row.draw
        found.setdefault((law, sensors, actuators), []).append(row)
    return [_cell(*key, own) for key, own in found.items()]


def _cell(law: Law, sensors: str, actuators: str, rows: Sequence[Row]) -> Cell:
    flown = [row.metrics for row in rows if not row.failure]
    metrics = {}
    for name in flown[0] if flown else ():
        low, middle, high = np.quantile([m[name] for m in flown], (0.05, 0.5, 0.95)).tolist()
        metrics[name] = low, middle, high
    return Cell(law, sensors, actuators, len(rows), len(rows) - len(flown), metrics)


def hardware(found: Sequence[Cell]) -> dict[str, list[str]]:
    """Return what the cells fly with, a value a cell: sensors, actuators, or both, unless ideal."""
    named = {
        "sensors": [cell.sensors for cell in found],
        "actuators": [cell.actuators for cell in found],
    }
    told = {key: values for key, values in named.items() if set(values) != {"ideal"}}
    return told or {"sensors": named["sensors"]}


def summary_table(found: Sequence[Cell]) -> Table:
    """Tabulate the medians, a group for every hardware."""
    flown_with, told = hardware(found), shown(found)
    columns = (
        Column("law", is_label=True), Column("gains", is_label=True),
        *(Column(name, unit, ".2g") for name, unit in told.values()),
        Column("failed"),
    )  # fmt: skip
    groups: dict[tuple[str, ...], list[list[Any]]] = {}
    for cell, *names in zip(found, *flown_with.values(), strict=True):
        middles = [cell.metrics[name][1] if name in cell.metrics else None for name in told]
        row = [cell.law.controller, cell.law.gains, *middles, f"{cell.failed} of {cell.flights}"]
        groups.setdefault(tuple(names), []).append([*names, *row])
    return Table(
        "Medians of errors and ripple",
        (*(Column(name, is_label=True) for name in flown_with), *columns),
        [Group(rows) for rows in groups.values()],
    )


def as_records(found: Sequence[Cell]) -> list[dict[str, Any]]:
    """Return a dictionary a cell, ready for JSON."""
    return [
        {
            "controller": cell.law.controller, "gains": cell.law.gains, "sensors": cell.sensors,
            "actuators": cell.actuators, "flights": cell.flights, "failed": cell.failed,
            "metrics": {
                name: dict(zip(("low", "median", "high"), values, strict=True))
                for name, values in cell.metrics.items()
            },
        }
        for cell in found
    ]  # fmt: skip


@house_style()
def figure(found: Sequence[Cell]) -> Figure:
    """Draw errors (left) and ripple (right) of every law by hardware; bars from 5 % to 95 %."""
    titles = [", ".join(map(plain, names)) for names in zip(*hardware(found).values(), strict=True)]
    kinds = list(dict.fromkeys(titles))
    laws = list(dict.fromkeys(cell.law for cell in found))
    told, names = shown(found), drawn(found)
    if not names:
        return page(12.0, "None of these flights came to its end.")
    sheet = page(130.0)
    legend_above(sheet, [law.title for law in laws], dashed=False)
    for axes, name in zip(grid(sheet, len(names), 2, shared=False), names, strict=True):
        for number, law in enumerate(laws):
            look, shift = Look.of(number), 0.09 * (number - 0.5 * (len(laws) - 1))
            own = [
                (kinds.index(title) + shift, c.metrics[name])
                for title, c in zip(titles, found, strict=True)
                if c.law == law and name in c.metrics
            ]
            places = [place for place, _ in own]
            low, middle, high = np.array([values for _, values in own]).reshape(-1, 3).T
            axes.errorbar(
                places, middle, yerr=(middle - low, high - middle), color=look.colour,
                marker=look.marker, linestyle="none", markersize=4,
            )  # fmt: skip
        heading, unit = told[name]
        axes.set_yscale("log")
        axes.set_ylabel(f"{heading} ({unit})" if unit else f"{heading} error")
        axes.set_xticks(range(len(kinds)), kinds)
        axes.set_xlim(-0.5, len(kinds) - 0.5)
    return sheet
