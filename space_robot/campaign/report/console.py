"""A report on a terminal and as Markdown: a table for every group."""

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
"""Variables a law."""
SECOND_INTERVAL = 5
"""The column of the league for which a terminal has no room."""
PLAIN, PARTIAL = 1, 2
"""The columns of the sensitivities, for one of which it has."""


def print_report(findings: Findings, console: Console) -> None:
    """Print the tables of a report, and the worst runs with the commands that fly them again."""
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
    """Write the tables as a document."""
    return as_markdown(f"Campaign {findings.subject.folder.name}", [*tables(findings)])


def tables(findings: Findings) -> Iterator[Table]:
    """Yield the tables, none of which has groups; what explains several stands below the last."""
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
    """Return which correlations are left out: the plain ones, if there are partial ones."""
    has_partial = any(i.partial for _, _, s in findings.sensitivities for i in s.influences)
    return PLAIN if has_partial else PARTIAL


def _without(table: Table, place: int) -> Table:
    """Return a table without its column at ``place``."""

    def kept(values: Any) -> list[Any]:
        return [*values[:place], *values[place + 1 :]]

    groups = [g._replace(rows=[kept(row) for row in g.rows]) for g in table.groups]
    return replace(table, columns=kept(table.columns), groups=groups)


def split(table: Table) -> Iterator[Table]:
    """Yield a table for every group of a table, the notes below the last."""
    for number, group in enumerate(table.groups, start=1):
        notes = table.notes if number == len(table.groups) else ()
        title = ": ".join(text for text in (group.name, group.note) if text) or table.title
        yield Table(title, table.columns, [Group(group.rows)], notes)
