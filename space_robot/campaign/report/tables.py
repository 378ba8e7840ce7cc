"""The tables of a report, the same on a terminal, in Markdown and on a page."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ...console.tables import Column, Group, JudgedCell, Table, named
from ..verdicts.laws import Estimate, League
from ..verdicts.requirements import Verdict
from ..verdicts.rows import GridPoint, law_rows
from .findings import CONFIDENCE, WORST, Findings, Quantity

if TYPE_CHECKING:
    from pandas import DataFrame

TONES = {
    **{"met": "good", "not met": "bad", "undecided": "open", "not measured": "open"},
    **{"better": "good", "worse": "bad", "alike": "open", "contradictory": "open"},
}
NO_DIFFERENCE = "no difference shown"
STRONGEST = 5
"""Variables in a table of influences."""
MOST_CASES = 8
"""Laws and grid points that are named in one cell; more are counted."""
BOUNDS = (
    "At least, at most: limits of the share of cases that meet the requirement, each at its "
    "confidence. Bound: with that confidence the metric is no worse in the demanded share of the "
    "cases (failed: too many flights failed; a dash: too few runs)."
)
FIXED_RUNS = "The number of runs was fixed before the first flight: one test, no runs added."
MORE_RUNS = (
    "More runs: until it is met if none of them fails; until it is decided, and how, if failures "
    "go on at their rate. Verdicts and limits hold at any number of runs, so runs may be added "
    "until a verdict is reached."
)


def _columns(labels: Sequence[str], numbers: Sequence[str] = ()) -> list[Column]:
    return [*map(named, labels), *map(Column, numbers)]


def number(value: float, spec: str = ".3g") -> str:
    """Format a number; infinity stands for failed flights."""
    return "failed" if math.isinf(value) else "-" if math.isnan(value) else format(value, spec)


def span(estimate: Estimate, spec: str = ".3g") -> str:
    """Format an interval; an infinite end is a question mark."""
    low, high = (format(x, spec) if math.isfinite(x) else "?" for x in estimate[1:])
    return f"{low} to {high}"


def _titled(*parts: str) -> str:
    return ", ".join(part for part in parts if part)


def summary_table(findings: Findings) -> Table:
    """Tabulate what flights warn of, verdicts by requirement, and remarks."""
    warned = findings.flight_warnings
    rows: list[list[Any]] = [["warning", JudgedCell("", text, "bad")] for text in warned]
    for quantity in findings.required:
        for word in ("met", "not met", "undecided", "not measured"):
            cases = [
                f"{findings.names[v.law]} ({v.point})" if v.point else findings.names[v.law]
                for v in findings.verdicts
                if (v.requirement, v.word) == (quantity.name, word)
            ]
            if cases:
                text = ", ".join(cases) if len(cases) <= MOST_CASES else f"{len(cases)} cases"
                if len(cases) == len(findings.laws) * len(findings.points) > 1:
                    text = f"all {len(cases)} cases"
                rows.append([quantity.title, JudgedCell(f"{text}:", word, TONES[word])])
    rows += [["remark", text] for text in findings.remarks]
    return Table.of("Findings", _columns(["", ""]), rows)


def flown_table(findings: Findings) -> Table:
    """Tabulate file, seed, runs, laws, variables and software versions of the campaign."""
    study = findings.study
    scenario = ", ".join(f"{key}: {_short(value)}" for key, value in study.scenario.items())
    rows = [
        ["campaign", str(findings.folder)],
        ["scenario", scenario or "all as by default"],
        ["laws", ", ".join(study.laws)],
        ["seed", str(findings.seed)],
        ["runs", f"{findings.table['run'].nunique()} of {findings.runs} under every law"],
        ["design", study.design],
        *([f"varied: {name}", _short(value)] for name, value in study.vary.items()),
        *([name, text] for name, text in findings.about.items()),
    ]
    return Table.of("What was flown", _columns(["", ""]), rows)


def _short(value: object) -> str:
    text = value if isinstance(value, str) else json.dumps(value, default=str).replace('"', "")
    return text if len(text) <= 160 else text[:157] + "..."


def outcome_table(findings: Findings) -> Table:
    """Tabulate how the flights of each law ended."""
    import pandas

    counts = pandas.crosstab(findings.table["law"], findings.table["outcome"]).loc[findings.laws]
    outcomes = sorted(map(str, counts), key=lambda outcome: (outcome != "complete", outcome))
    rows = [
        [findings.names[law], *map(str, row)]
        for law, *row in counts[outcomes].itertuples(name=None)
    ]
    return Table.of("How the flights ended", _columns(["law"], outcomes), rows)


def demand_text(quantity: Quantity) -> str:
    """Return the text of a requirement."""
    demand = quantity.requirement
    assert demand is not None
    way = "below" if demand.above is None else "above"
    angle = ""
    if demand.metric in ("attitude.rms", "attitude.max") and 0.0 <= demand.bound <= 1.0:
        angle = f" (an angle of {math.degrees(2.0 * math.asin(demand.bound)):.3g} deg)"
    return (
        f"{quantity.heading} {way} {demand.bound:g} {quantity.unit}".rstrip()
        + angle
        + f" in {100.0 * demand.share:g} % of the cases, "
        f"shown with {100.0 * demand.confidence:g} % confidence"
    )


def verdict_table(findings: Findings, quantity: Quantity) -> Table:
    """Tabulate the verdicts on a requirement, a row for each grid point and law."""
    numbers = ["missed in", "at least", "at most", "bound"]
    if not findings.study.has_fixed_runs:
        numbers.append("more runs")
    columns = _columns([*_grid_names(findings), "law", "verdict"], numbers)
    values = {point.point: point.values for point in findings.points}
    rows = [
        [*values[v.point], *_verdict_row(v, findings.names[v.law])][: len(columns)]
        for v in findings.verdicts
        if v.requirement == quantity.name
    ]
    return Table.of(f"{quantity.title}: {demand_text(quantity)}", columns, rows)


def _verdict_row(v: Verdict, name: str) -> list[str | JudgedCell]:
    missed, more = f"{v.failures} of {v.runs}", "-"
    if v.word == "undecided":
        without = "many" if v.needed_without_failure is None else str(v.needed_without_failure)
        decision = "undecided"
        if v.projected_decision is not None:
            runs, met = v.projected_decision
            decision = f"{runs - v.runs}: {'met' if met else 'not met'}"
        more = f"{without}; {decision}"
    return [
        name,
        JudgedCell("", v.word, TONES[v.word]),
        f"{missed}, {v.not_measured} not measured" if v.not_measured else missed,
        f"{100.0 * v.limits.low:.4g} %",
        f"{100.0 * v.limits.high:.4g} %",
        "-" if v.bound is None else number(v.bound),
        more,
    ]


def verdict_grid(findings: Findings, quantity: Quantity) -> Table:
    """Tabulate a requirement's verdicts over a grid: points as rows, laws as columns."""
    cells = {
        (v.point, v.law): JudgedCell(
            "" if v.not_measured else f"{v.failures}", v.word, TONES[v.word]
        )
        for v in findings.verdicts
        if v.requirement == quantity.name
    }
    rows = [
        [*point.values, *(cells.get((point.point, law)) for law in findings.laws)]
        for point in findings.points
    ]
    columns = _columns(_grid_names(findings), list(findings.names.values()))
    return Table.of(f"{quantity.title}: {demand_text(quantity)}", columns, rows)


def _grid_names(findings: Findings) -> list[str]:
    return [name.removeprefix("scenario.") for name in findings.grid]


def verdict_notes(findings: Findings) -> list[str]:
    """Return the explanation of the columns, and the probability of any false verdict."""
    if not findings.required:
        return []
    columns = f"{BOUNDS} {FIXED_RUNS if findings.study.has_fixed_runs else MORE_RUNS}"
    if findings.grid:
        columns = "Runs that miss it, and the verdict."
    count = len(findings.verdicts)
    each = max(1.0 - q.requirement.confidence for q in findings.required if q.requirement)
    one = f"A verdict is false with a probability of at most {each:.2g}"
    if count == 1:
        return [columns, f"{one}."]
    return [
        columns,
        f"{one}, and any of these {count} with at most {findings.family_error:.2g}: for "
        f"{each:.2g} in all, ask each for a confidence of {1.0 - each / count:.4g}.",
    ]


def league_tables(findings: Findings) -> list[Table]:
    """Tabulate the leagues of a campaign without grid, one table per metric."""
    columns = _columns(["law"], ["rank", "median", "interval", "99 %", "failed"])
    return [
        Table.of(
            metric.label,
            columns,
            [
                [
                    findings.names[s.law],
                    str(s.rank),
                    number(s.median.value),
                    span(s.median),
                    number(s.tail.value),
                    f"{s.failures} of {s.runs}",
                ]
                for s in league.standings
            ],
        )
        for _, metric, league in findings.leagues
    ]


def pair_tables(findings: Findings) -> list[Table]:
    """Tabulate every pair of laws at each grid point, one table per metric."""
    numbers = ["better in", "median ratio", "interval", "p", "only it fails", "p of failures"]
    columns = _columns([*_grid_names(findings), "law", "compared with", "is"], numbers)
    words = {"alike": NO_DIFFERENCE, "contradictory": "contradictory: failures and numbers"}
    return [
        Table.of(
            f"Pairs of laws, {metric.label}",
            columns,
            [
                [
                    *point.values,
                    findings.names[c.law],
                    findings.names[c.other],
                    JudgedCell("", words.get(c.finding, c.finding), TONES[c.finding]),
                    f"{c.better} of {c.runs}",
                    number(c.ratio.value),
                    span(c.ratio),
                    f"{c.p_better:.2g}",
                    f"{c.failed}, other {c.other_failed}",
                    f"{c.p_failed:.2g}",
                ]
                for point, other, league in findings.leagues
                if other is metric
                for c in league.comparisons
            ],
        )
        for metric in findings.metrics
    ]


def choice_tables(findings: Findings) -> list[Table]:
    """Tabulate medians and the best laws at each point of the grid, one table per metric."""
    columns = _columns(_grid_names(findings), list(findings.names.values()))
    columns.append(named("to fly"))
    return [
        Table.of(
            metric.label,
            columns,
            [
                [
                    *point.values,
                    *_medians(findings, league),
                    JudgedCell("", _best(findings, league), "good"),
                ]
                for point, other, league in findings.leagues
                if other is metric
            ],
        )
        for metric in findings.metrics
    ]


def _medians(findings: Findings, league: League) -> list[str]:
    texts = dict.fromkeys(findings.laws, "-")
    for s in league.standings:
        failed = f" ({100.0 * s.failures / s.runs:.2g})" if s.failures else ""
        texts[s.law] = f"{number(s.median.value, '.2g')}{failed}"
    return list(texts.values())


def _best(findings: Findings, league: League) -> str:
    first = [s.law for s in league.standings if s.rank == 1 and s.failures < s.runs]
    if len(first) == len(league.standings) > 1:
        return NO_DIFFERENCE
    return ", ".join(findings.names[law] for law in first) or "-"


def influence_tables(findings: Findings) -> list[Table]:
    """Tabulate the strongest significant influences, one table per law and quantity."""
    columns = _columns(["variable"], ["rank corr.", "interval", "spread", "p"])
    tables = []
    for point, quantity, result in findings.sensitivities:
        rows = []
        for i in result.influences[:STRONGEST]:
            best = i.best_correlation
            cells = [f"{best.value:.2f}", span(best, ".2f")] if best else ["-", "-"]
            if i.p < 1.0 - CONFIDENCE:
                rows.append([i.variable, *cells, f"{i.spread:.1%}", f"{i.p:.2g}"])
        title = _titled(findings.names[result.law], quantity.heading, point.point)
        if result.explained is not None:
            title += f": {result.explained:.0%} explained by all"
        if rows:
            tables.append(Table.of(title, columns, rows))
    return tables


def sobol_tables(findings: Findings) -> list[Table]:
    """Tabulate Sobol indices, one table per law and metric."""
    columns = _columns(["variable"], ["first", "interval", "total", "interval"])
    tables = []
    for each in findings.sobol:
        left_out = f"; {each.left_out} with failed flights left out" if each.left_out else ""
        title = f"Sobol indices, {each.law}, {each.metric}: {each.rows} rows of the design"
        rows = [
            [i.variable, *(text for e in (i.first, i.total) for text in _index(e))]
            for i in each.indices[:STRONGEST]
        ]
        tables.append(Table.of(title + left_out, columns, rows))
    return tables


def _index(estimate: Estimate) -> tuple[str, str]:
    return f"{estimate.value:.3f}", span(estimate, ".3f")


def worst_table(findings: Findings, point: GridPoint, quantity: Quantity, law: str = "") -> Table:
    """Tabulate the worst runs, with the command that flies the first of them again."""
    worst = findings.worst(point, quantity, law=law)
    values, runs, laws = _values(worst, quantity), worst["run"].tolist(), worst["law"].tolist()
    notes = [f"{findings.rerun_command(runs[0], laws[0])}    # the first of them"]
    if len(set(values)) == 1 and len(values) == WORST:
        rows = law_rows(point.table, law) if law else point.table
        same = _values(rows, quantity).count(values[0])
        equal = f"All {WORST} are equal, as {same:,} of {len(rows):,} flights are: {values[0]}"
        notes.insert(0, f"{equal}; none of them is worse than the others.")
    title = f"Worst runs by {_titled(quantity.label, point.point, findings.names.get(law, ''))}"
    texts = [list(map(str, row)) for row in zip(runs, laws, values, strict=True)]
    columns = [Column("run"), named("law"), Column("value")]
    return Table(title, columns, [Group(texts)], notes)


def _values(rows: DataFrame, quantity: Quantity) -> list[str]:
    columns = rows[["outcome", "ended_at_s", quantity.column]].astype(
        {"ended_at_s": float, quantity.column: float}
    )
    return [
        number(value, ".4g")
        if outcome == "complete"
        else f"{outcome} at {end:.3g} s"
        if end >= 0.0
        else outcome
        for outcome, end, value in columns.itertuples(index=False, name=None)
    ]
