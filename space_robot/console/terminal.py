"""Text, JSON and tables on a terminal.

Texts from bags and users are never interpreted as markup, and unprintable characters are replaced.
Rich shrinks columns of a table wherever it finds room, within words and numbers, too. Here a column
is at least as wide as its longest word, or cell of numbers; what does not fit follows as a further
part.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import takewhile
from typing import Any, NamedTuple

import click
from rich.box import SIMPLE_HEAD
from rich.cells import cell_len
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

from space_robot_msgs_py.config.text import printable

from .tables import Column, JudgedCell, Table, Value, cell_text

LONGEST_WORD = 24
"""Characters of a label's word that stay in one line; longer words, such as paths, are folded."""
TONE_COLOURS = {"good": "green", "bad": "red", "open": "yellow"}


class _Console(Console):
    def render_str(self, text: str, **options: Any) -> Text:
        """Make all displayed text printable: sentences, titles and cells."""
        return super().render_str("\n".join(map(printable, text.split("\n"))), **options)


def terminal(**options: Any) -> Console:
    """Return a console without markup; ``options`` are those of `rich.console.Console`.

    In a notebook it prints text, too: rich's HTML for notebooks has a fixed width.
    """
    return _Console(markup=False, emoji=False, highlight=False, force_jupyter=False, **options)


def say(console: Console, text: str) -> None:
    """Print a text as one line; the terminal wraps it."""
    console.print(text, soft_wrap=True)


def echo_json(report: Any) -> None:
    """Print a report as JSON; NaN and infinity become null."""
    click.echo(json_text(report))


def json_text(report: Any) -> str:
    """Return a report as JSON; NaN and infinity become null."""
    return json.dumps(_finite(report), indent=2, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


class _Cells(NamedTuple):
    heading: str
    is_label: bool
    cells: list[str | Text]

    def widths(self, is_broken: bool) -> tuple[int, int]:
        """Return the least width, and the one with which nothing is wrapped."""
        texts = [str(cell) for cell in self.cells]
        least = _longest(text.split() for text in texts)
        if self.is_label:
            least = min(least, LONGEST_WORD)
        elif not is_broken:
            least = _longest(text.split("\n") for text in texts)
        least = max(least, _longest([self.heading.split()]), 1)
        return least, max(least, _longest(text.split("\n") for text in (self.heading, *texts)))


def print_table(table: Table, console: Console, *, dense: bool = False) -> None:
    """Print a table and its notes; a table that is too wide is printed in parts.

    Args:
        table: to be printed.
        console: to print on.
        dense: without vertical lines at the sides, for long numbers.
    """
    for line in filter(None, table.title.split("\n")):
        say(console, " ".join(line.split()))
    room = console.width + (1 if dense else -1)  # without the lines at both sides
    columns = _columns(table)
    if sum(most + 3 for _, most in (c.widths(False) for c in columns)) > room:
        for place, column in enumerate(reversed(table.columns), 1):
            if column.unit:  # stays whole, as N m
                heading = f"{column.name},\n{column.unit}"
                columns[-place] = columns[-place]._replace(heading=heading)
    ends = {sum(len(g.rows) for g in table.groups[:k]) - 1 for k in range(1, len(table.groups) + 1)}
    for part, widths in _parts(columns, room):
        shown = RichTable(
            show_header=any(column.heading for column in table.columns),
            box=SIMPLE_HEAD if dense else RichTable().box,
            show_edge=not dense,
            width=sum(widths) + 3 * len(widths) + (-1 if dense else 1),
        )
        for cells, width in zip(part, widths, strict=True):
            justify: Any = "left" if cells.is_label else "right"
            shown.add_column(cells.heading, justify=justify, width=width, overflow="fold")
        for number, row in enumerate(zip(*(cells.cells for cells in part), strict=True)):
            shown.add_row(*row, end_section=number in ends)
        console.print(shown, crop=False)
    for note in table.notes:
        say(console, note)


def _columns(table: Table) -> list[_Cells]:
    rows = [(group, n, row) for group in table.groups for n, row in enumerate(group.rows)]
    columns = [
        _Cells(column.heading, column.is_label, [_cell(row[k], column) for *_, row in rows])
        for k, column in enumerate(table.columns)
    ]
    if any(group.name for group in table.groups):
        names = [group.name if n == 0 else "" for group, n, _ in rows]
        columns.insert(0, _Cells("", True, [*names]))
    return columns


def _cell(value: Value, column: Column) -> str | Text:
    if isinstance(value, JudgedCell):
        text = f"{value.text} " if value.text else ""
        return Text.assemble(text, (value.word, TONE_COLOURS[value.tone]))
    return cell_text(value, column)


def _parts(columns: Sequence[_Cells], room: int) -> Iterator[tuple[Sequence[_Cells], list[int]]]:
    """Yield the columns of each part with their widths; each part begins with the labels."""
    for is_broken in (False, True):
        if widths := _fit(columns, room, is_broken):
            yield columns, widths
            return
    labels = [*takewhile(lambda column: column.is_label, columns)]
    rest = list(columns[len(labels) :])
    while rest:
        counts = range(len(rest), 1, -1)
        count = next((k for k in counts if _fit([*labels, *rest[:k]], room, False)), 1)
        part = [*labels, *rest[:count]]
        yield part, _fit(part, room, False) or [column.widths(False)[0] for column in part]
        rest = rest[count:]


def _fit(columns: Sequence[_Cells], room: int, is_broken: bool) -> list[int] | None:
    """Return widths with the spare room shared out evenly; None if the columns do not fit."""
    sizes = [column.widths(is_broken) for column in columns]
    widths = [least for least, _ in sizes]
    spare = room - sum(least + 3 for least in widths)  # a line and two blanks
    if spare < 0:
        return None
    while spare and (narrow := [k for k, (_, most) in enumerate(sizes) if widths[k] < most]):
        for k in narrow[:spare]:
            widths[k] += 1
        spare -= min(spare, len(narrow))
    return widths


def _longest(texts: Iterable[Iterable[str]]) -> int:
    return max((cell_len(printable(text)) for parts in texts for text in parts), default=0)
