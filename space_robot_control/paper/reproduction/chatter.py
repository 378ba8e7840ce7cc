"""The chatter of the laws beside one another: the flights of case 1, with printed friction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from ...analysis.tables import Column, Table
from .flights import Result

COLUMNS = ("base_torque", "torque_1_3", "torque_4_6")


class Chatter(NamedTuple):
    """One flight's chatter, by the keys of ``COLUMNS``."""

    controller: str
    gains: str
    total_variation_per_s: dict[str, float]
    """N m/s, mean of the axes."""
    power_above_100_hz: dict[str, float]
    """Share of the power, mean of the axes."""


def chatter_table(found: Sequence[Chatter]) -> Table:
    """Tabulate the chatter of the laws."""
    names = ("base", "joints 1-3", "joints 4-6")
    columns = (
        Column("controller", is_label=True), Column("gains", is_label=True),
        *(Column(f"{name}: variation", "N m/s", ".3g") for name in names),
        *(Column(f"{name}: power > 100 Hz", spec=".1e") for name in names),
    )  # fmt: skip
    rows = [
        [
            x.controller, x.gains,
            *(x.total_variation_per_s[column] for column in COLUMNS),
            *(x.power_above_100_hz[column] for column in COLUMNS),
        ]
        for x in found
    ]  # fmt: skip
    return Table.of("Chatter in case 1, printed friction", columns, rows)


def chatter(results: Sequence[Result]) -> list[Chatter]:
    """Collect it of every flight of case 1 with friction that did not diverge."""
    return [
        Chatter(r.row.controller, r.variant.gains, **_merits(r.chatter))
        for r in results
        if r.chatter is not None
    ]


def _merits(chatter: dict[str, dict[str, float]]) -> dict[str, dict[str, float]]:
    return {
        name: {column: values[column] for column in COLUMNS} for name, values in chatter.items()
    }
