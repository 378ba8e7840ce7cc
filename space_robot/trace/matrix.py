"""The matrix of requirements and evidence: as a table, Markdown, a page, and data for JSON."""

from __future__ import annotations

import datetime
from collections import Counter
from collections.abc import Mapping
from itertools import zip_longest
from pathlib import Path
from typing import Any

from ..analysis.report import template
from ..console.files import atomic_folder
from ..console.tables import Column, JudgedCell, Table, as_markdown, named
from ..console.terminal import json_text
from ..processes.software import commit, versions
from .evidence import GRAVEST_FIRST, Evidence
from .requirements import RequirementSet

BRIEF = ("id", "method", "measured", "limits", "verdict", "confidence")
"""Columns on a terminal."""


def matrix_record(
    file: str, content: RequirementSet, evidence: Mapping[str, Evidence]
) -> dict[str, Any]:
    """Return the matrix of the requirements that have evidence, as data for JSON.

    ``file`` names their file. Only the date depends on the time.
    """
    counts = Counter(each.verdict for each in evidence.values())
    parts = (f"{counts[verdict]} {verdict}" for verdict in reversed(GRAVEST_FIRST))
    made_from = {"file": file, "date": datetime.date.today().isoformat(), "commit": commit()}
    every = content.requirements
    return {
        "title": content.title,
        "summary": f"{len(evidence)} requirements: {', '.join(parts)}",
        "made_from": made_from | versions(),
        "requirements": [
            {
                "id": id_,
                **every[id_].model_dump(include={"text", "rationale", "allocated_to"}),
                "method": every[id_].evidence[0],
                "source": every[id_].source,
                **each._asdict(),
            }
            for id_, each in evidence.items()
        ],
    }


def matrix_table(record: dict[str, Any], is_brief: bool = False) -> Table:
    """Tabulate a `matrix_record`, a row a number; ``is_brief``: with the columns `BRIEF` only."""
    tones = {"verified": "good", "violated": "bad"}
    names = BRIEF if is_brief else tuple(record["requirements"][0])
    columns = [Column(n, spec=".4g") if n == "measured" else named(n) for n in names]
    rows = []
    for row in record["requirements"]:
        verdict = JudgedCell("", row["verdict"], tones.get(row["verdict"], "open"))
        cells = {**{key: value or None for key, value in row.items()}, "verdict": verdict}
        for value, limit in [*zip_longest(row["measured"], row["limits"])] or [(None, None)]:
            cells |= {"measured": value, "limits": limit}
            rows.append([cells[name] for name in names])
            cells = dict.fromkeys(row, "")  # further numbers have these two columns alone
    return Table.of(record["title"], columns, rows, record["summary"])


def write_matrix(record: dict[str, Any], folder: Path) -> None:
    """Write a `matrix_record` into a folder, as Markdown, a page, and JSON.

    Raises:
        InputError: the folder cannot be written.
    """
    software = [[key, text] for key, text in record["made_from"].items()]
    tables = [matrix_table(record), Table.of("Made from", [named(), named()], software)]
    page = template("space_robot.trace", "matrix.html.j2")
    with atomic_folder(folder) as new:
        (new / "matrix.md").write_text(as_markdown(record["title"], tables), "utf-8")
        (new / "matrix.html").write_text(page.render(record, tables=tables), "utf-8")
        (new / "matrix.json").write_text(json_text(record) + "\n", "utf-8")
