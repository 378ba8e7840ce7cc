"""Tables of sensitivities and Sobol indices."""

from __future__ import annotations

from collections.abc import Sequence

from ...console.tables import Column, Group, Table
from ..verdicts.sensitivity import Influence
from ..verdicts.sobol import SobolIndices
from .findings import CONFIDENCE, Findings
from .league_tables import span

SHOWN = 10
"""Variables shown per law."""


def sensitivity_table(findings: Findings, shown: int = SHOWN) -> Table:
    """Tabulate the strongest influences, one group per law and quantity.

    Only significant influences are listed; a note names the groups without any.
    """
    columns = [
        Column("variable", is_label=True),
        Column("rank corr."),
        Column("partial"),
        Column("interval"),
        Column("spread"),
        Column("p"),
    ]
    groups, without = [], []
    for part, quantity, sensitivity in findings.sensitivities:
        explained = (
            "" if sensitivity.explained is None else f"{sensitivity.explained:.0%} explained by all"
        )
        law = findings.names[sensitivity.law]
        name = ", ".join(text for text in (law, quantity.heading, part.point) if text)
        rows = [_row(i) for i in sensitivity.influences[:shown] if i.p < 1.0 - CONFIDENCE]
        if rows:
            groups.append(Group(rows, name, explained))
        else:
            without.append(name)
    note = (
        "Rank correlation (Spearman): positive if more of the variable makes it worse; partial: "
        "with the other numbers held fixed, and its interval (the plain one's if there is none). "
        "Spread: the share of the spread of ranks that the variable explains by itself, whatever "
        "the shape (Kruskal and Wallis); p of no influence at all, corrected after Holm. Intervals "
        f"are of {CONFIDENCE:.0%}. Failed flights rank worst."
    )
    notes = [f"No variable is shown to drive: {'; '.join(without)}."] if without else []
    return Table("What drives it", columns, groups, [note, *notes] if groups else notes)


def _row(influence: Influence) -> list[str]:
    plain, partial = influence.correlation, influence.partial
    best = partial or plain
    cells = [
        "-" if plain is None else f"{plain.value:.2f}",
        "-" if partial is None else f"{partial.value:.2f}",
        "-" if best is None else span(best, ".2f"),
    ]
    return [influence.variable, *cells, f"{influence.spread:.1%}", f"{influence.p:.2g}"]


def sobol_table(indices: Sequence[SobolIndices], shown: int = SHOWN) -> Table:
    """Tabulate Sobol indices, one group per law and metric."""
    columns = [
        Column("variable", is_label=True),
        Column("first"),
        Column("interval"),
        Column("total"),
        Column("interval"),
    ]
    groups = []
    for each in indices:
        rows = [
            [
                i.variable,
                f"{i.first.value:.3f}",
                span(i.first, ".3f"),
                f"{i.total.value:.3f}",
                span(i.total, ".3f"),
            ]
            for i in each.indices[:shown]
        ]
        left_out = f"; {each.left_out} with failed flights left out" if each.left_out else ""
        note = f"{each.rows} rows of the design{left_out}"
        groups.append(Group(rows, f"{each.law}, {each.metric}", note))
    note = (
        "Shares of the metric's variance: what a variable brings by itself (first), and with all "
        f"that it does together with others (total); bootstrap intervals of {CONFIDENCE:.0%}."
    )
    return Table("Sobol indices", columns, groups, [note])
