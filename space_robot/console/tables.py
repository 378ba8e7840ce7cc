"""Data model of all tables, and their text as Markdown and LaTeX.

`terminal.print_table` prints it on a terminal, ``templates/table.html.j2`` in a page.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

NONE = "-"
"""Text of a missing value."""


class Column(NamedTuple):
    """Name and format of a column."""

    name: str = ""
    unit: str = ""
    spec: str = ""
    """Format of the column's numbers, such as ``.3g``."""
    is_label: bool = False
    """True: left-aligned, may be wrapped. False: right-aligned, never cut."""

    @property
    def heading(self) -> str:
        """Name and unit."""
        return f"{self.name}, {self.unit}" if self.unit else self.name


def named(name: str = "") -> Column:
    """Return a column of names or other texts."""
    return Column(name, is_label=True)


class JudgedCell(NamedTuple):
    """A cell with a verdict."""

    text: str
    """Text before the verdict, such as ``1.03 < 1``; may be empty."""
    word: str
    tone: str
    """``good``, ``bad`` or ``open``."""

    @classmethod
    def of(cls, is_good: bool, good: str, bad: str, text: str = "") -> JudgedCell:
        """Return a cell with one of two verdicts."""
        return cls(text, good, "good") if is_good else cls(text, bad, "bad")

    def __str__(self) -> str:
        """Return text and verdict."""
        return f"{self.text} {self.word}".strip()


Value = str | float | JudgedCell | None
Row = Sequence[Any]
"""One `Value` per column."""


class Group(NamedTuple):
    """A named group of rows."""

    rows: Sequence[Row]
    name: str = ""
    note: str = ""
    """Explanation of the group for new readers."""


@dataclass(frozen=True)
class Table:
    """A table: columns, which define the number formats, and groups of rows."""

    title: str
    columns: Sequence[Column]
    groups: Sequence[Group]
    notes: Sequence[str] = ()
    """Sentences below the table."""

    @classmethod
    def of(cls, title: str, columns: Sequence[Column], rows: Sequence[Row], *notes: str) -> Table:
        """Return a table with one group without name."""
        return cls(title, columns, [Group(rows)], notes)

    def texts(self, group: Group) -> Iterator[list[str]]:
        """Yield each row of a group as texts."""
        for row in group.rows:
            yield [cell_text(v, column) for v, column in zip(row, self.columns, strict=True)]


def cell_text(value: Value, column: Column) -> str:
    """Format a value as defined by its column."""
    if value is None:
        return NONE
    return str(value) if isinstance(value, (str, JudgedCell)) else format(value, column.spec)


ESCAPED = str.maketrans(
    {c: f"\\{c}" for c in "&%$#_{}"}
    | {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
    | {"<": "$<$", ">": "$>$", "\u00a0": r"\,"}
)
"""What LaTeX would not print as it is; a protected blank is a narrow one, as in units."""


def as_latex(table: Table) -> str:
    """Return a table as LaTeX, in the style of its package booktabs; the title is the caption."""
    count, rows = len(table.columns), list[str]()
    for group in table.groups:
        if group.name:
            name = group.name.translate(ESCAPED)
            rows += [r"\midrule", rf"\multicolumn{{{count}}}{{l}}{{\textit{{{name}}}}} \\"]
        for row in group.rows:
            cells = (_latex_cell(v, column) for v, column in zip(row, table.columns, strict=True))
            rows.append(" & ".join(cells) + r" \\")
    lines = [
        r"\begin{table}",
        r"\centering",
        rf"\caption{{{table.title.translate(ESCAPED)}}}",
        rf"\begin{{tabular}}{{{''.join('l' if c.is_label else 'r' for c in table.columns)}}}",
        r"\toprule",
        " & ".join(column.heading.translate(ESCAPED) for column in table.columns) + r" \\",
        *rows,
        *(r"\bottomrule", r"\end{tabular}", r"\end{table}", ""),
    ]
    return "\n".join(lines)


def _latex_cell(value: Value, column: Column) -> str:
    if not isinstance(value, float):
        return cell_text(value, column).translate(ESCAPED)
    if not math.isfinite(value):
        return r"$\infty$" if value > 0.0 else "--"
    digits, _, power = format(value, column.spec).partition("e")
    return f"${digits.rstrip('.')}" + (rf"\times10^{{{int(power)}}}$" if power else "$")


def as_markdown(title: str, tables: Sequence[Table]) -> str:
    """Return tables as a Markdown document."""
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
