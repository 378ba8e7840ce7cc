"""One model for all tables, and its forms as text: Markdown, CSV, JSON.

`terminal.print_table` shows it on a terminal, ``templates/table.html.j2`` in a page.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

NONE = "-"
"""Stands for a number that there is not."""


class Column(NamedTuple):
    """The head of a column."""

    name: str = ""
    unit: str = ""
    spec: str = ""
    """Format of the column's numbers, as in ``.3g``."""
    is_label: bool = False
    """Labels stand left and may be folded; all else stands right and is never cut."""

    @property
    def heading(self) -> str:
        """Name and unit."""
        return f"{self.name}, {self.unit}" if self.unit else self.name


class JudgedCell(NamedTuple):
    """A cell that ends in a judgement."""

    text: str
    """The number that is judged, as in ``1.03 < 1``; may be empty."""
    word: str
    tone: str
    """``good``, ``bad`` or ``open``."""

    def __str__(self) -> str:
        """Return the text and the word."""
        return f"{self.text} {self.word}".strip()


Value = str | float | JudgedCell | None
Row = Sequence[Any]
"""A `Value` a column."""


class Group(NamedTuple):
    """Rows that belong together."""

    rows: Sequence[Row]
    name: str = ""
    note: str = ""
    """The group's meaning, for someone who sees it for the first time."""


@dataclass(frozen=True)
class Table:
    """Rows of values under columns, in groups; it is up to its columns how numbers are written."""

    title: str
    columns: Sequence[Column]
    groups: Sequence[Group]
    notes: Sequence[str] = ()
    """Sentences below the table."""

    @classmethod
    def of(cls, title: str, columns: Sequence[Column], rows: Sequence[Row]) -> Table:
        """Make a table of one group without a name."""
        return cls(title, columns, [Group(rows)])

    @property
    def has_named_groups(self) -> bool:
        """True if the groups' names are part of the table."""
        return any(group.name for group in self.groups)

    def texts(self, group: Group) -> Iterator[list[str]]:
        """Yield each row of a group as texts."""
        for row in group.rows:
            yield [text_of(v, column) for v, column in zip(row, self.columns, strict=True)]


def text_of(value: Value, column: Column) -> str:
    """Write a value as its column asks for."""
    if value is None:
        return NONE
    return str(value) if isinstance(value, (str, JudgedCell)) else format(value, column.spec)


def as_markdown(title: str, tables: Sequence[Table]) -> str:
    """Write a document of tables."""
    lines = [f"# {title}", ""]
    for table in tables:
        lines += [f"## {table.title}", ""]
        lines.append("| " + " | ".join(column.heading for column in table.columns) + " |")
        lines.append("|" + "---|" * len(table.columns))
        for group in table.groups:
            lines += ["| " + " | ".join(row) + " |" for row in table.texts(group)]
        lines.append("")
        for note in table.notes:
            lines += [note, ""]
    return "\n".join(lines)


def as_csv(table: Table) -> str:
    """Write the columns' names and all values in full precision; what there is not is empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(column.name for column in table.columns)
    for group in table.groups:
        writer.writerows(group.rows)
    return text.getvalue()


def as_records(table: Table) -> list[dict[str, Any]]:
    """Return a dictionary a row, by the columns' names, ready for JSON."""
    names = [column.name for column in table.columns]
    return [dict(zip(names, row, strict=True)) for group in table.groups for row in group.rows]
