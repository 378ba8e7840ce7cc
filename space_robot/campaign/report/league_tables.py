"""Tables that compare laws: leagues, pairs, and the best laws at each point of a grid."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from ...console.tables import Column, Group, JudgedCell, Table
from ..verdicts.league import League, Ranking
from ..verdicts.paired import PairedComparison
from ..verdicts.quantiles import Estimate
from .findings import CONFIDENCE, Findings
from .quantities import Quantity

TONES = {"better": "good", "worse": "bad", "alike": "open", "contradictory": "open"}
WORDS = {
    "better": "better",
    "worse": "worse",
    "alike": "not told apart",
    "contradictory": "better, but fails more often, or the other way round",
}
RANKS = (
    f"A law ranks below another only where the comparison over the same draws shows it with "
    f"{CONFIDENCE:.0%} confidence (sign test and interval of the median ratio, or failures; "
    "corrected over all pairs of a metric after Holm). Laws of one rank are not told apart. "
    "Quantiles count a failed flight as worse than any number; "
    f"intervals are of {CONFIDENCE:.0%}, each by itself."
)


def number(value: float, spec: str = ".3g") -> str:
    """Format a number; infinity stands for failed flights."""
    return "failed" if math.isinf(value) else "-" if math.isnan(value) else format(value, spec)


def span(estimate: Estimate, spec: str = ".3g") -> str:
    """Format an interval; an infinite end is a question mark."""
    low, high = (format(x, spec) if math.isfinite(x) else "?" for x in estimate[1:])
    return f"{low} to {high}"


def league_table(findings: Findings) -> Table:
    """Tabulate the leagues of a campaign without grid, one group per metric."""
    columns = [
        Column("law", is_label=True),
        Column("rank"),
        Column("median"),
        Column("interval"),
        Column("99 %"),
        Column("interval"),
        Column("failed"),
    ]
    groups = [
        Group([_standing(s, findings.names[s.law]) for s in league.standings], metric.label)
        for _, metric, league in findings.leagues
    ]
    return Table("Laws, by metrics of which less is better", columns, groups, [RANKS])


def _standing(s: Ranking, name: str) -> list[str]:
    return [
        name,
        str(s.rank),
        number(s.median.value),
        span(s.median),
        number(s.tail.value),
        span(s.tail),
        f"{s.failures} of {s.runs}",
    ]


def pair_table(findings: Findings) -> Table:
    """Tabulate every pair of laws, one group per metric and grid point."""
    columns = [
        Column("law", is_label=True),
        Column("beside", is_label=True),
        Column("better in"),
        Column("median ratio"),
        Column("interval"),
        Column("p"),
        Column("fails alone"),
        Column("p of failures"),
        Column("is", is_label=True),
    ]
    groups = [
        Group([_pair(c, findings.names) for c in league.comparisons], metric.label, part.point)
        for part, metric, league in findings.leagues
    ]
    note = (
        "Better in: runs in which the law's number is smaller than the other's in the same draw. "
        "p: of the exact sign test, and of the same test over the runs in which just one of the "
        "two failed; both corrected after Holm."
    )
    return Table("Laws by pairs, over the same draws", columns, groups, [note])


def _pair(c: PairedComparison, names: Mapping[str, str]) -> list[str | JudgedCell]:
    return [
        names[c.law],
        names[c.other],
        f"{c.better} of {c.runs}",
        number(c.ratio.value),
        span(c.ratio),
        f"{c.p_better:.2g}",
        f"{c.failed}, other {c.other_failed}",
        f"{c.p_failed:.2g}",
        JudgedCell("", WORDS[c.finding], TONES[c.finding]),
    ]


def choice_tables(findings: Findings) -> list[Table]:
    """Tabulate the best laws at each point of the grid, one table per metric.

    The grid's variables and the laws are columns, points are rows. The last table has the notes.
    """
    tables = [_choices(findings, metric) for metric in findings.metrics]
    note = (
        "Medians; in brackets the flights that failed, in %. To fly: the laws than which none is "
        f"shown to be better, with {CONFIDENCE:.0%} confidence at each point."
    )
    return [*tables[:-1], *(replace(table, notes=[note]) for table in tables[-1:])]


def _choices(findings: Findings, metric: Quantity) -> Table:
    rows = [
        [
            *part.values,
            *_medians(findings, league),
            JudgedCell("", best(league, findings.names), "good"),
        ]
        for part, quantity, league in findings.leagues
        if quantity is metric
    ]
    columns = [
        *(Column(name.removeprefix("scenario."), is_label=True) for name in findings.grid),
        *map(Column, findings.names.values()),
        Column("to fly", is_label=True),
    ]
    return Table(metric.label, columns, [Group(rows)])


def _medians(findings: Findings, league: League) -> list[str]:
    by_law = {s.law: s for s in league.standings}
    texts = []
    for law in findings.laws:
        if (s := by_law.get(law)) is None:
            texts.append("-")
            continue
        failed = f" ({100.0 * s.failures / s.runs:.2g})" if s.failures else ""
        texts.append(f"{number(s.median.value, '.2g')}{failed}")
    return texts


def best(league: League, names: Mapping[str, str]) -> str:
    """Return the laws of rank 1 that completed a flight, unless these are all laws."""
    first = [names[s.law] for s in league.standings if s.rank == 1 and s.failures < s.runs]
    if len(first) == len(league.standings) > 1:
        return "not told apart"
    return ", ".join(first) or "-"
