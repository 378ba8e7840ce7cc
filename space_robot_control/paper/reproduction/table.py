"""Measured beside printed: one record a flight, definition and column; Markdown, CSV, JSON."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from typing import Any, NamedTuple

from .flights import DEFINITIONS, VARIANTS, Result, Variant
from .table_v import COLUMNS, HEADINGS, printed


class Cell(NamedTuple):
    """One number of Table V and its counterpart."""

    controller: str
    case: str
    gains: str
    friction: bool
    definition: str
    column: str
    measured: float | None
    """None if the flight diverged."""
    printed: float
    ratio: float | None
    diverged_tick: int | None


def cells(results: Sequence[Result]) -> list[Cell]:
    """Every comparison of every flight."""
    return [
        _cell(result, definition, column)
        for result in results
        for definition in DEFINITIONS
        for column in COLUMNS
    ]


def _cell(result: Result, definition: str, column: str) -> Cell:
    row, variant = result.row, result.variant
    expected = printed(row.controller, row.case, column)
    measured = result.rms[definition][column] if result.rms else None
    return Cell(
        row.controller, row.case, variant.gains, variant.friction, definition, column, measured,
        expected, None if measured is None else measured / expected, result.diverged_tick,
    )  # fmt: skip


def as_csv(comparison: Sequence[Cell]) -> str:
    """One line a cell, with a heading; full precision."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(Cell._fields)
    writer.writerows(comparison)
    return text.getvalue()


def as_records(comparison: Sequence[Cell]) -> list[dict[str, Any]]:
    """The same for JSON."""
    return [cell._asdict() for cell in comparison]


class Block(NamedTuple):
    """A table as texts."""

    title: str
    headings: list[str]
    rows: list[list[str]]


def blocks(comparison: Sequence[Cell]) -> list[Block]:
    """One table a variant flown and definition, cells ``measured / printed (ratio)``."""
    found = []
    for definition, meaning in DEFINITIONS.items():
        for variant in VARIANTS:
            rows = _rows(comparison, variant, definition)
            headings = ["controller", "case", *HEADINGS.values()]
            if rows:
                found.append(Block(f"{variant.title}; {meaning}", headings, rows))
    return found


def _rows(comparison: Sequence[Cell], variant: Variant, definition: str) -> list[list[str]]:
    rows: dict[tuple[str, str], list[str]] = {}
    for cell in comparison:
        if (cell.gains, cell.friction, cell.definition) != (*_key(variant), definition):
            continue
        row = rows.setdefault((cell.controller, cell.case), [cell.controller, cell.case])
        row.append(_text(cell))
    return list(rows.values())


def _key(variant: Variant) -> tuple[str, bool]:
    return variant.gains, variant.friction


def _text(cell: Cell) -> str:
    if cell.measured is None or cell.ratio is None:
        return f"diverged at tick {cell.diverged_tick}"
    form = ".4f" if "torque" in cell.column else ".2e"
    ratio = f"{cell.ratio:.3f}" if cell.ratio > 0.01 else f"{cell.ratio:.1e}"
    return f"{cell.measured:{form}} / {cell.printed:{form}} ({ratio})"


def as_markdown(title: str, tables: Sequence[Block]) -> str:
    """A document of tables."""
    lines = [f"# {title}", ""]
    for table in tables:
        lines += [f"## {table.title}", ""]
        lines.append("| " + " | ".join(table.headings) + " |")
        lines.append("|" + "---|" * len(table.headings))
        lines += ["| " + " | ".join(row) + " |" for row in table.rows]
        lines.append("")
    return "\n".join(lines)
