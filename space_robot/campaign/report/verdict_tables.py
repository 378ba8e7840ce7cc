"""Tables of verdicts on requirements, and of the worst runs."""

from __future__ import annotations

import math
import shlex
from pathlib import Path

from ...console.tables import Column, Group, JudgedCell, Table
from ..flown.flown_campaign import needs_trust
from ..study import Study
from ..verdicts import requirements
from ..verdicts.values import GridPoint
from .findings import Findings
from .league_tables import number
from .quantities import Quantity

TONES = {"met": "good", "not met": "bad", "undecided": "open", "not measured": "open"}
MORE_RUNS = "more runs"


def verdict_table(findings: Findings) -> Table:
    """Tabulate the verdicts, one group per requirement and grid point."""
    columns = [
        Column("law", is_label=True),
        Column("verdict", is_label=True),
        Column("missed in"),
        Column("at least"),
        Column("at most"),
        Column("bound"),
        *([] if findings.subject.study.has_fixed_runs else [Column(MORE_RUNS)]),
    ]
    groups = []
    for quantity in findings.required:
        for part in findings.parts:
            rows = [
                _row(v, findings.names[v.law])[: len(columns)]
                for v in findings.verdicts
                if (v.requirement, v.point) == (quantity.name, part.point)
            ]
            name = f"{quantity.name}, {part.point}" if part.point else quantity.name
            groups.append(Group(rows, name, demanded(quantity)))
    return Table("Requirements", columns, groups, notes(findings))


def demanded(quantity: Quantity) -> str:
    """Return the text of a requirement."""
    requirement = quantity.requirement
    assert requirement is not None
    way = "below" if requirement.above is None else "above"
    angle = ""
    if requirement.metric in ("attitude.rms", "attitude.max") and 0.0 <= requirement.bound <= 1.0:
        angle = f" (an angle of {math.degrees(2.0 * math.asin(requirement.bound)):.3g} deg)"
    return (
        f"{quantity.heading} {way} {quantity.limit:g} {quantity.unit}".rstrip()
        + angle
        + f" in {100.0 * requirement.share:g} % of the cases, "
        f"shown with {100.0 * requirement.confidence:g} % confidence"
    )


def notes(findings: Findings) -> list[str]:
    """Return the explanation of the columns and of the error probability."""
    if not findings.required:
        return []
    columns = (
        "At least, at most: limits of the share of cases that meet the requirement, each at its "
        "confidence. Bound: with that confidence the metric is no worse in the demanded share of "
        "the cases (failed: too many flights failed; a dash: too few runs)."
    )
    if findings.subject.study.has_fixed_runs:
        way = "The number of runs was fixed before the first was flown: one look, no runs added."
    else:
        columns += (
            " More runs: until it is met if none of them fails; until it is decided, and how, if "
            "failures go on at their rate."
        )
        way = (
            "All of it holds at whatever number of runs one looks or stops, so runs may be added "
            "until a verdict is reached."
        )
    return [columns, f"{way} {_how_often_false(findings)}"]


def method(findings: Findings) -> str:
    """Return the description of the statistical method, in a sentence."""
    if findings.subject.study.has_fixed_runs:
        return (
            "By order statistics (Hanson and Beard, NASA/TP-2010-216447): met, if so few runs "
            "would miss the requirement only with the probability that the confidence leaves "
            "over, were the share any smaller; not met, if the same holds of so many; else "
            "undecided."
        )
    return (
        "By a confidence sequence (Robbins 1970; Howard and others 2021): met, if the share of "
        "cases that meet the requirement is above the demanded one with its confidence, whenever "
        "one looks; not met, if it is below; else undecided."
    )


def _how_often_false(findings: Findings) -> str:
    """Return the error probability of one verdict, and of all together, as a sentence."""
    count = len(findings.verdicts)
    each = max(1.0 - q.requirement.confidence for q in findings.required if q.requirement)
    one = f"A verdict is false with a probability of at most {each:.2g}"
    if count == 1:
        return f"{one}."
    return (
        f"{one}, and any of these {count} with at most {findings.family_error:.2g}: for "
        f"{each:.2g} in all, ask each for a confidence of {1.0 - each / count:.4g}."
    )


def _row(v: requirements.Verdict, name: str) -> list[str | JudgedCell]:
    missed = f"{v.failures} of {v.runs}"
    return [
        name,
        JudgedCell("", v.word, TONES[v.word]),
        f"{missed}, {v.not_measured} not measured" if v.not_measured else missed,
        f"{100.0 * v.limits.low:.4g} %",
        f"{100.0 * v.limits.high:.4g} %",
        "-" if v.bound is None else number(v.bound),
        _more(v),
    ]


def _more(v: requirements.Verdict) -> str:
    if v.word != "undecided":
        return "-"
    without = "many" if v.needed_without_failure is None else f"{v.needed_without_failure}"
    if v.projected_decision is None:
        going_on = "undecided"
    else:
        runs, met = v.projected_decision
        going_on = f"{runs - v.runs}: {'met' if met else 'not met'}"
    return f"{without}; {going_on}"


def verdict_grid(findings: Findings, quantity: Quantity) -> Table:
    """Tabulate a requirement's verdicts over a grid: points as rows, laws as columns."""
    by_place = {(v.point, v.law): v for v in findings.verdicts if v.requirement == quantity.name}
    rows = []
    for part in findings.parts:
        verdicts = [by_place.get((part.point, law)) for law in findings.laws]
        cells = [
            JudgedCell("" if v.not_measured else f"{v.failures}", v.word, TONES[v.word])
            if v
            else None
            for v in verdicts
        ]
        rows.append([*part.values, *cells])
    columns = [
        *(Column(name.removeprefix("scenario."), is_label=True) for name in findings.grid),
        *map(Column, findings.names.values()),
    ]
    note = f"Runs that miss it, and the verdict. {_how_often_false(findings)}"
    return Table(f"{quantity.name}: {demanded(quantity)}", columns, [Group(rows)], [note])


def worst_table(
    findings: Findings, part: GridPoint, quantity: Quantity, count: int = 10, law: str = ""
) -> Table:
    """Tabulate the worst runs with the commands to rerun them."""
    columns = [
        Column("run"),
        Column("law", is_label=True),
        Column("value"),
        Column("to fly it again", is_label=True),
    ]
    rows, subject = findings.worst(part, quantity, count, law), findings.subject
    of = f", {part.point}" if part.point else ""
    return Table.of(
        f"Worst runs by {quantity.label}{of}",
        columns,
        [
            [
                str(run),
                name,
                _value(row, quantity),
                command(subject.folder, subject.study, run, name),
            ]
            for run, name, row in zip(
                rows["run"].tolist(), rows["law"], rows.to_dict("records"), strict=True
            )
        ],
    )


def _value(row: dict[str, object], quantity: Quantity) -> str:
    if row["outcome"] == "complete":
        return number(float(row[quantity.column]), ".4g")  # type: ignore[arg-type]
    return f"{row['outcome']} at {row['ended_at_s']:.3g} s"


def command(folder: Path, study: Study, run: int, law: str) -> str:
    """Return the command that flies a row again and records a bag."""
    words = ["space-robot", "campaign", "rerun", str(folder), str(run), "--law", law]
    name = law.replace("/", "_").replace("=", "_")
    trust = ["--trust"] if needs_trust(study) else []
    return shlex.join([*words, "--bag", f"flights/{run}_{name}", *trust])
