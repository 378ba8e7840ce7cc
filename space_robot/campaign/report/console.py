"""A report on a terminal and as Markdown, with a table for every group."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from rich.console import Console

from ...console.tables import Group, Table, as_markdown
from ...console.terminal import say
from ...console.terminal_tables import print_table
from .findings import Findings
from .flown_tables import flown_table, outcome_table
from .league_tables import choice_tables, league_table
from .sensitivity_tables import sensitivity_table, sobol_table
from .verdict_tables import verdict_grid, verdict_table, worst_table

INFLUENCES = 3
"""Variables shown per law."""
SECOND_INTERVAL = 5
"""Column of the league that is too wide for a terminal."""
PLAIN, PARTIAL = 1, 2
"""Columns of the sensitivities, of which a terminal shows one."""


def print_report(findings: Findings, console: Console) -> None:
    """Print the tables of a report, and the worst runs with the commands to rerun them."""
    for table in tables(findings):
        print_table(table, console, dense=True)
        say(console, "")
    for quantity in findings.driven:
        worst = worst_table(findings, findings.whole, quantity)
        say(console, worst.title)
        for *_, value, command in worst.groups[0].rows:
            say(console, f"  {value}: {command}")
    for remark in findings.remarks:
        say(console, remark)


def markdown(findings: Findings) -> str:
    """Return the tables as a Markdown document."""
    return as_markdown(f"Campaign {findings.subject.folder.name}", [*tables(findings)])


def tables(findings: Findings) -> Iterator[Table]:
    """Yield the tables, without groups; notes on several tables follow the last of them."""
    yield flown_table(findings)
    yield outcome_table(findings)
    if findings.grid:
        yield from (verdict_grid(findings, quantity) for quantity in findings.required)
        yield from choice_tables(findings)
    else:
        yield from split(verdict_table(findings))
        yield from split(_without(league_table(findings), SECOND_INTERVAL))
        yield from split(_without(sensitivity_table(findings, INFLUENCES), _weaker(findings)))
    yield from split(sobol_table(findings.sobol, INFLUENCES))


def _weaker(findings: Findings) -> int:
    """Return the column of correlations to omit: the plain ones, if there are partial ones."""
    has_partial = any(i.partial for _, _, s in findings.sensitivities for i in s.influences)
    return PLAIN if has_partial else PARTIAL


def _without(table: Table, place: int) -> Table:
    """Return a table without the column ``place``."""

    def kept(values: Any) -> list[Any]:
        return [*values[:place], *values[place + 1 :]]

    groups = [g._replace(rows=[kept(row) for row in g.rows]) for g in table.groups]
    return replace(table, columns=kept(table.columns), groups=groups)


def split(table: Table) -> Iterator[Table]:
    """Split a table into one per group, with the notes below the last."""
    for number, group in enumerate(table.groups, start=1):
        notes = table.notes if number == len(table.groups) else ()
        title = ": ".join(text for text in (group.name, group.note) if text) or table.title
        yield Table(title, table.columns, [Group(group.rows)], notes)
