"""Content of a report as data for JSON."""

from __future__ import annotations

from dataclasses import fields, is_dataclass
from typing import Any

from .findings import Findings
from .verdict_tables import command


def record(findings: Findings) -> dict[str, Any]:
    """Return verdicts, leagues, comparisons, sensitivities and the worst runs."""
    subject = findings.subject
    return {
        "campaign": str(subject.folder),
        "seed": subject.seed,
        "runs": subject.runs,
        "rows": len(subject.table),
        "laws": findings.laws,
        "grid": list(findings.grid),
        "about": dict(subject.about),
        "remarks": findings.remarks,
        "outcomes": {
            law: {str(k): int(n) for k, n in rows["outcome"].value_counts().items()}
            for law, rows in subject.table.groupby("law", sort=False)
        },
        "requirements": [{**plain(v), "share": v.share} for v in findings.verdicts],
        "any_verdict_false_at_most": findings.family_error,
        "leagues": [
            {
                "point": part.point,
                "metric": metric.name,
                "standings": plain(entry.standings),
                "comparisons": [{**plain(c), "finding": c.finding} for c in entry.comparisons],
            }
            for part, metric, entry in findings.leagues
        ],
        "sensitivity": [
            {"point": part.point, "of": quantity.column, **plain(entry)}
            for part, quantity, entry in findings.sensitivities
        ],
        "sobol": plain(findings.sobol),
        "worst": [
            {
                "point": part.point,
                "of": quantity.column,
                "run": int(row["run"]),
                "law": row["law"],
                "outcome": row["outcome"],
                "reason": row["reason"],
                "value": row[quantity.column],
                "command": command(subject.folder, subject.study, int(row["run"]), row["law"]),
            }
            for quantity in findings.driven
            for part in findings.parts
            for row in findings.worst(part, quantity).to_dict("records")
        ],
    }


def plain(value: Any) -> Any:
    """Convert dataclasses and named tuples to dictionaries, recursively."""
    if is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, tuple) and hasattr(value, "_asdict"):
        return {key: plain(inner) for key, inner in value._asdict().items()}
    return [plain(inner) for inner in value] if isinstance(value, (list, tuple)) else value
