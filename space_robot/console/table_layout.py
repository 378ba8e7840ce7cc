"""Widths of the columns of a table on a terminal, so that numbers and words stay whole.

Rich shrinks columns wherever it finds room, within words and numbers, too. Here a column is at
least as wide as its longest word, or cell of numbers, and the rest of the room is shared out.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import replace
from itertools import takewhile
from typing import Any

from rich.cells import cell_len
from rich.table import Column, Table
from rich.text import Text

from space_robot_msgs_py.config.text import printable

LONGEST_WORD = 24
"""Characters of a label's word that stay in one line; longer words, such as paths, are folded."""
LEAST_COLUMNS = 2
"""Columns beside the labels in each part of a table that is printed in parts."""


def fitted(table: Table, width: int) -> list[Table]:
    """Return a table with column widths for a terminal, in parts if it is too wide.

    Cells of numbers are broken between words only if the table is too wide otherwise. Each part
    begins with the labels that stand before the first column of numbers.

    Args:
        table: its right-justified columns hold the numbers.
        width: of the terminal.

    Returns:
        The parts; none if a number or a word of a label would be broken in them, too.
    """
    for breaks_cells in (False, True):
        if (whole := _with_widths(table, table.columns, width, breaks_cells)) is not None:
            return [whole]
    labels = list(takewhile(lambda column: not is_number(column), table.columns))
    rest = table.columns[len(labels) :]
    parts = []
    while rest:
        fits = [
            part
            for count in range(1, len(rest) + 1)
            if (part := _with_widths(table, [*labels, *rest[:count]], width, False)) is not None
        ]
        if len(fits) < min(LEAST_COLUMNS, len(rest)):
            return []
        parts.append(fits[-1])
        rest = rest[len(fits) :]
    return parts


def is_number(column: Column) -> bool:
    """Return True for a column of numbers, False for one of labels."""
    return column.justify == "right"


def plain(cell: Any) -> str:
    """Return the text of a cell in one line."""
    return " ".join(_text(cell).split())


def _text(cell: Any) -> str:
    return cell.plain if isinstance(cell, Text) else str(cell)


def _with_widths(
    table: Table, columns: Sequence[Column], width: int, breaks_cells: bool
) -> Table | None:
    """Return the table with some of its columns; None if they do not fit."""
    shown = [replace(column, _index=number) for number, column in enumerate(columns)]
    sizes = [_sizes(column, breaks_cells, table.show_header) for column in shown]
    room = width - _frame(table, len(shown))
    if sum(least for least, _ in sizes) > room:
        return None
    for column, size in zip(shown, _shared(sizes, room), strict=True):
        column.width, column.overflow = size, "fold"
    part = copy(table)
    part.columns = shown
    return part


def _sizes(column: Column, breaks_cells: bool, has_header: bool) -> tuple[int, int]:
    """Return the least width of a column, and the one with which nothing is wrapped."""
    cells = [_text(cell) for cell in column.cells]
    header = _text(column.header) if has_header else ""
    lines = [line for text in (header, *cells) for line in text.split("\n")]
    words = _longest(header.split())
    if is_number(column):
        words = max(words, _longest(word for text in cells for word in text.split()))
        if not breaks_cells:
            words = max(words, _longest(line for text in cells for line in text.split("\n")))
    else:
        longest = _longest(word for text in cells for word in text.split())
        words = max(words, min(longest, LONGEST_WORD))
    return max(words, 1), max(_longest(lines), words, 1)


def _longest(texts: Any) -> int:
    return max((cell_len(printable(text)) for text in texts), default=0)


def _shared(sizes: Sequence[tuple[int, int]], room: int) -> list[int]:
    """Return widths between the least and the largest, with the room shared out evenly."""
    widths = [least for least, _ in sizes]
    spare = room - sum(widths)
    while spare and (narrow := [k for k, (_, most) in enumerate(sizes) if widths[k] < most]):
        for k in narrow[:spare]:
            widths[k] += 1
        spare -= min(spare, len(narrow))
    return widths


def _frame(table: Table, count: int) -> int:
    """Return the width of lines and padding around the cells of ``count`` columns."""
    lines = (count - 1 + 2 * table.show_edge) if table.box else 0
    return lines + count * (table.padding[1] + table.padding[3])
