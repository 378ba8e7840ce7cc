"""Text and tables on a terminal of any width.

Texts from bags and users are never interpreted as markup, and unprintable characters are
replaced. A table that is too wide is printed in parts, or as lines.
"""

from __future__ import annotations

import json
import math
from typing import Any

import click
from rich.console import Console
from rich.table import Table
from rich.text import Text

from space_robot_msgs_py.config.text import printable

from .table_layout import fitted, is_number, plain


class _Console(Console):
    def render_str(self, text: str, **options: Any) -> Text:
        """Make all displayed text printable: sentences, titles and cells."""
        return super().render_str("\n".join(map(printable, text.split("\n"))), **options)


def terminal(**options: Any) -> Console:
    """Return a console without markup; ``options`` are those of `rich.console.Console`.

    In a notebook it prints text, too: rich's HTML for notebooks has a fixed width.
    """
    return _Console(markup=False, emoji=False, highlight=False, force_jupyter=False, **options)


def echo_json(report: Any) -> None:
    """Print a report as JSON; NaN and infinity become null."""
    click.echo(json.dumps(_finite(report), indent=2, allow_nan=False))


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def say(console: Console, text: str) -> None:
    """Print a text as one line; the terminal wraps it."""
    console.print(text, soft_wrap=True)


def show(table: Table, console: Console) -> None:
    """Print a table, in parts or as lines if numbers or words of labels would be broken.

    Right-justified columns hold the numbers.
    """
    parts = fitted(table, console.width)
    if not parts:
        _print_lines(table, console)
        return
    _print_title(table, console)
    for part in parts:
        part.title = None  # it would be wrapped to the table's width
        console.print(part)


def _print_title(table: Table, console: Console) -> None:
    for line in str(table.title or "").split("\n"):
        if line:
            say(console, plain(line))


def _print_lines(table: Table, console: Console) -> None:
    """Print each row's labels, and below them one line per number."""
    _print_title(table, console)
    cells = {id(column): [plain(cell) for cell in column.cells] for column in table.columns}
    numbers = [column for column in table.columns if is_number(column)]
    labels = [column for column in table.columns if not is_number(column)]
    group = ""
    for row in range(table.row_count):
        first, *others = [cells[id(column)][row] for column in labels] or [""]
        group = first or group  # only the first row of a group has it
        if label := " ".join(filter(None, (group, *others))):
            say(console, label)
        for column in numbers:
            if value := cells[id(column)][row]:
                header = plain(str(column.header).replace("-\n", ""))  # a hyphenated word
                say(console, f"  {header}: {value}" if header else f"  {value}")
