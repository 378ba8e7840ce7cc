"""Printing of tables on a terminal."""

from __future__ import annotations

from typing import Any

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.measure import Measurement
from rich.table import Table as RichTable
from rich.text import Text

from .tables import Column, JudgedCell, Table, Value, text_of
from .terminal import say, show

UNLIMITED = 10_000
"""Width of a terminal on which every table fits."""
TONES = {"good": "green", "bad": "red", "open": "yellow"}


def print_table(table: Table, console: Console, *, dense: bool = False) -> None:
    """Print a table and its notes; a table that is too wide is printed in parts or as lines.

    Args:
        table: to be printed.
        console: to print on.
        dense: without vertical lines at the sides, for long numbers.
    """
    style: dict[str, Any] = {"box": SIMPLE_HEAD, "show_edge": False} if dense else {}
    shown = RichTable(
        title=table.title or None,
        show_header=any(column.heading for column in table.columns),
        **style,
    )
    is_grouped = table.has_named_groups
    if is_grouped:
        shown.add_column("")
    for column in table.columns:
        shown.add_column(column.heading, justify="left" if column.is_label else "right")
    for group in table.groups:
        for number, row in enumerate(group.rows):
            name = [group.name if number == 0 else ""] if is_grouped else []
            cells = [_cell(value, c) for value, c in zip(row, table.columns, strict=True)]
            shown.add_row(*name, *cells, end_section=number == len(group.rows) - 1)
    if Measurement.get(console, console.options.update(width=UNLIMITED), shown).maximum > (
        console.width
    ):
        for column, heading in zip(reversed(table.columns), reversed(shown.columns), strict=False):
            if column.unit:  # stays whole, as N m
                heading.header = f"{column.name},\n{column.unit}"
    show(shown, console)
    for note in table.notes:
        say(console, note)


def _cell(value: Value, column: Column) -> str | Text:
    if isinstance(value, JudgedCell):
        return Text.assemble(
            f"{value.text} " if value.text else "", (value.word, TONES[value.tone])
        )
    return text_of(value, column)
