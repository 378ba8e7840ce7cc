"""Tables: measured and printed values, and the chatter of the laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple
from typing import NamedTuple

from ...console.tables import Column, Table
from .flights import CHATTER, DEFINITIONS, VARIANTS, Result, Variant
from .table_v import COLUMNS, HEADINGS, TORQUE, printed

COLUMN_HEADS = (
    Column("controller", is_label=True),
    Column("case", is_label=True),
    *(Column(*heading) for heading in HEADINGS.values()),
)


class Cell(NamedTuple):
    """One number of Table V and the measured value."""

    controller: str
    case: str
    gains: str
    friction: bool
    definition: str
    column: str
    measured: float | None
    """Measured value; None if the flight diverged."""
    printed: float
    ratio: float | None
    diverged_tick: int | None


def cells(results: Sequence[Result]) -> list[Cell]:
    """Compare every flight with Table V in every column, by both definitions."""
    return [
        _cell(result, definition, column)
        for result in results
        for definition in DEFINITIONS
        for column in COLUMNS
    ]


def _cell(result: Result, definition: str, column: str) -> Cell:
    row, variant = result.row, result.variant
    expected = printed(row.controller, row.case, column)
    measured = result.metrics[f"{column}.{definition}"] if result.metrics else None
    return Cell(
        row.controller,
        row.case,
        variant.gains,
        variant.friction,
        definition,
        column,
        measured,
        expected,
        None if measured is None else measured / expected,
        result.diverged_tick,
    )


def cells_table(comparison: Sequence[Cell]) -> Table:
    """Tabulate one cell per row, for other programs."""
    return Table.of("Table V", [Column(name) for name in Cell._fields], comparison)


def variant_tables(comparison: Sequence[Cell]) -> list[Table]:
    """Tabulate each variant and definition, with cells ``measured / printed (ratio)``."""
    tables = []
    for definition, meaning in DEFINITIONS.items():
        for variant in VARIANTS:
            rows = _rows(comparison, variant, definition)
            if rows:
                tables.append(Table.of(f"{variant.title}; {meaning}", COLUMN_HEADS, rows))
    return tables


def _rows(comparison: Sequence[Cell], variant: Variant, definition: str) -> list[list[str]]:
    rows: dict[tuple[str, str], list[str]] = {}
    for cell in comparison:
        if (cell.gains, cell.friction, cell.definition) == (*astuple(variant), definition):
            row = rows.setdefault((cell.controller, cell.case), [cell.controller, cell.case])
            row.append(_text(cell))
    return list(rows.values())


def _text(cell: Cell) -> str:
    if cell.measured is None or cell.ratio is None:
        return f"diverged at tick {cell.diverged_tick}"
    form = ".4f" if "torque" in cell.column else ".2e"
    ratio = f"{cell.ratio:.3f}" if cell.ratio > 0.01 else f"{cell.ratio:.1e}"
    return f"{cell.measured:{form}} / {cell.printed:{form}} ({ratio})"


class LawChatter(NamedTuple):
    """Chatter of a flight of case 1 with printed friction, by torque column of Table V."""

    controller: str
    gains: str
    variation: dict[str, float]
    """Total variation per time, mean of the axes, N m/s."""
    chatter: dict[str, float]
    """Share of the power above 100 Hz, mean of the axes."""


def chatter(results: Sequence[Result]) -> list[LawChatter]:
    """Return the chatter of every compared flight that did not diverge."""
    return [
        LawChatter(
            r.row.controller,
            r.variant.gains,
            *({c: r.metrics[f"{c}.{key}"] for c in TORQUE} for key in CHATTER),
        )
        for r in results
        if r.chatters and r.metrics
    ]


def chatter_table(chatter: Sequence[LawChatter]) -> Table:
    """Tabulate the chatter of the laws."""
    names = ("base", "joints 1-3", "joints 4-6")
    columns = (
        Column("controller", is_label=True),
        Column("gains", is_label=True),
        *(Column(f"{name}: variation", "N m/s", ".3g") for name in names),
        *(Column(f"{name}: power > 100 Hz", spec=".1e") for name in names),
    )
    rows = [
        [
            x.controller,
            x.gains,
            *(x.variation[column] for column in TORQUE),
            *(x.chatter[column] for column in TORQUE),
        ]
        for x in chatter
    ]
    return Table.of("Chatter in case 1, printed friction", columns, rows)
