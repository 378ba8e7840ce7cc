"""The whole reproduction: fly, compare, draw, write a folder."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.flight_log import FlightLog

from ..analysis.figures import chatter as chatter_figure
from ..analysis.figures import desired_joints, junctions, save_figure
from .chatter import HEADINGS as CHATTER_HEADINGS
from .chatter import chatter
from .claims import claims
from .flights import VARIANTS, Result, Row, collect, flights
from .provenance import parameters, provenance
from .report import Chapter, Picture, render
from .table import Block, as_csv, as_markdown, as_records, blocks, cells

TABLE = "table_v"
FULL_DURATION = 30.0
"""s, of the mission that Table V is about."""
FIGURE_OF_CASE = {"1": "6", "2": "7", "3": "8", "4-1": "9a", "4-2": "9b"}


def check_folder(folder: Path) -> None:
    """See that the results may be written there.

    Raises:
        InputError: something else is there.
    """
    if not folder.exists():
        return
    if not folder.is_dir():
        raise InputError(f"{folder}: is no folder; name another with --out")
    if any(folder.iterdir()) and not (folder / f"{TABLE}.json").is_file():
        raise InputError(f"{folder}: holds other files; name another folder with --out")


def reproduce(
    rows: Sequence[Row],
    folder: Path,
    *,
    duration: float | None = None,
    jobs: int = 1,
    progress: Callable[[int], Callable[[], None]] = lambda total: lambda: None,
) -> dict[str, Any]:
    """Fly ``rows`` under every variant and write table, figures and report into ``folder``.

    Args:
        rows: of Table V.
        folder: made or renewed at the end, whole; an older reproduction there is replaced.
        duration: s to fly (None: the mission's 30 s, which is what Table V is about).
        jobs: processes at work.
        progress: called with the number of flights, gives what is called after each.

    Returns:
        What is written as JSON.

    Raises:
        InputError: the folder holds something else.
    """
    check_folder(folder)
    folder.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=folder.parent, prefix=".reproduce-") as temporary:
        work = Path(temporary) / folder.name
        figures = work / "figures"
        figures.mkdir(parents=True)
        with flights(rows, duration, figures, jobs) as futures:
            results = collect(futures, progress(len(futures)))
        record = _write(rows, results, duration or FULL_DURATION, work)
        if folder.exists():
            shutil.rmtree(folder)
        work.rename(folder)
    return record


def _write(
    rows: Sequence[Row], results: Sequence[Result], duration: float, folder: Path
) -> dict[str, Any]:
    comparison = cells(results)
    judged, chattering = claims(results, comparison), chatter(results)
    chatter_table = Block(
        "Chatter in case 1, printed friction", CHATTER_HEADINGS, [c.texts() for c in chattering]
    )
    tables = [*blocks(comparison), chatter_table]
    flown = {**provenance(), "duration_s": duration}
    told = {
        f"{row.controller}, case {row.case}, {gains} gains": parameters(
            row.controller, row.case, gains
        )
        for row in rows
        for gains in dict.fromkeys(variant.gains for variant in VARIANTS)
    }
    record = {
        "provenance": flown,
        "claims": [claim.as_record() for claim in judged],
        "cells": as_records(comparison),
        "chatter": [row._asdict() for row in chattering],
        "parameters": told,
    }
    title = "Table V: measured / printed (ratio)"
    (folder / f"{TABLE}.md").write_text(as_markdown(title, tables), "utf-8")
    (folder / f"{TABLE}.csv").write_text(as_csv(comparison), "utf-8")
    (folder / f"{TABLE}.json").write_text(json.dumps(record, indent=1) + "\n", "utf-8")
    page = render(flown, told, judged, tables, _chapters(rows, results, folder / "figures"))
    (folder / "report.html").write_text(page, "utf-8")
    return record


def _chapters(rows: Sequence[Row], results: Sequence[Result], figures: Path) -> list[Chapter]:
    logs = {r.row.controller: r.log for r in results if r.log is not None}
    chapters = []
    if logs:
        chapters.append(_comparisons(logs, figures))
    for case, figure in FIGURE_OF_CASE.items():
        pictures = [
            Picture(f"Figure {figure}: {row.controller}, {row.shown.title}", path)
            for row in rows
            if row.case == case
            and (path := figures / f"case{case}_{row.controller}.png").is_file()
        ]  # fmt: skip
        if pictures:
            chapters.append(Chapter(f"Case {case}", pictures))
    return chapters


def _comparisons(logs: dict[str, FlightLog], figures: Path) -> Chapter:
    drawn = [
        ("figure5_desired_joints", desired_joints(next(iter(logs.values()))),
         "Figure 5: desired joint angles"),
        ("chatter", chatter_figure(logs), "Chatter of the base torque in case 1"),
        ("junctions", junctions(logs), "Base torque at the junction of the two motions, case 1"),
    ]  # fmt: skip
    pictures = [
        Picture(caption, save_figure(figure, figures / name)[0]) for name, figure, caption in drawn
    ]
    return Chapter("The mission, and the laws beside one another", pictures)
