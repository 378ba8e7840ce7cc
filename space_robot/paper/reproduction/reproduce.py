"""Runs the complete reproduction: flights, comparison, figures, folder of results."""

from __future__ import annotations

import json
import platform
import shutil
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from space_robot_msgs_py.config.installation import config_directory
from space_robot_msgs_py.errors import InputError

from ...analysis.figures.figure_set import FigureFolder
from ...analysis.template import template
from ...console.tables import as_csv, as_markdown, as_records
from ...flight.plan import Flight, FlightPlan, resolve
from ...processes.executor import run_all
from ...processes.software import commit, versions
from .claims import claims, claims_table
from .figures import comparisons, figure_groups
from .flights import PERFECT, Equipment, Planned, Result, TableRow, fly, plan
from .table import cells, cells_table, chatter, chatter_table, variant_tables

TABLE = "table_v"
ERRATA = "docs/explanation/errata.md"
"""Located beside ``config``, in the source tree and in an installation."""
FULL_DURATION = 30.0
"""Duration of the mission of Table V, s."""


def check_folder(folder: Path) -> None:
    """Check that the results may be written to a folder.

    Raises:
        InputError: it contains other files, or is not a folder.
    """
    if not folder.exists():
        return
    if not folder.is_dir():
        raise InputError(f"{folder}: not a folder; choose another with --out")
    if any(folder.iterdir()) and not (folder / f"{TABLE}.json").is_file():
        raise InputError(f"{folder}: contains other files; choose another folder with --out")


def reproduce(
    rows: Sequence[TableRow],
    folder: Path,
    *,
    duration: float | None = None,
    brief: bool = False,
    equipment: Equipment = PERFECT,
    jobs: int,
    progress: Callable[[int], Callable[[], None]] = lambda total: lambda: None,
) -> dict[str, Any]:
    """Fly ``rows`` and write table, figures and report into ``folder``.

    Args:
        rows: of Table V.
        folder: written atomically at the end; an older reproduction is replaced.
        duration: of the flights, s (None: 30 s, as in Table V).
        brief: fly only what Table V needs, see `plan`; figures as SVG only.
        equipment: sensors, navigation and actuators; Table V assumes ideal ones.
        jobs: number of processes.
        progress: called with the number of flights; returns a function to call after each one.

    Returns:
        The content of the JSON file.

    Raises:
        InputError: the folder contains other files, or the base has no attitude actuators.
    """
    check_folder(folder)
    if not Flight(resolve(FlightPlan(actuators=equipment.actuators))).controls_base:
        raise InputError(
            f"actuators {equipment.actuators}: Table V has attitude errors and base torques, so "
            "the base needs attitude actuators"
        )
    folder.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=folder.parent, prefix=".reproduce-") as temporary:
        work = Path(temporary) / folder.name
        figures = FigureFolder(work / "figures", png=not brief)
        figures.path.mkdir(parents=True)
        results = _fly(list(plan(rows, brief)), duration, figures, equipment, jobs, progress)
        run_all(_call, comparisons(results, duration, figures), jobs)
        record = _write(rows, results, duration or FULL_DURATION, brief, equipment, figures)
        if folder.exists():
            shutil.rmtree(folder)
        work.rename(folder)
    return record


def _fly(
    planned: Sequence[Planned],
    duration: float | None,
    figures: FigureFolder,
    equipment: Equipment,
    jobs: int,
    progress: Callable[[int], Callable[[], None]],
) -> list[Result]:
    """Fly and draw every flight; return the results in the order of ``planned``."""
    fly_one = partial(fly, duration=duration, figures=figures, equipment=equipment)
    order = sorted(planned, key=lambda flight: not flight.shown)  # longest first
    results = dict(zip(order, run_all(fly_one, order, jobs, progress), strict=True))
    return [results[flight] for flight in planned]


def _call(draw: Callable[[], None]) -> None:
    draw()


def _write(
    rows: Sequence[TableRow],
    results: Sequence[Result],
    duration: float,
    brief: bool,
    equipment: Equipment,
    figures: FigureFolder,
) -> dict[str, Any]:
    folder, comparison = figures.path.parent, cells(results)
    judged, chattering = claims(results, comparison), chatter(results)
    tables = [*variant_tables(comparison), chatter_table(chattering)]
    numbers = cells_table(comparison)
    provenance = {
        "commit": commit(),
        "versions": versions(),
        "machine": f"{platform.system()} {platform.machine()}",
        "duration_s": duration,
        "brief": brief,
        "sensors": equipment.sensors,
        "navigation": equipment.navigation,
        "actuators": equipment.actuators,
    }
    content = {
        f"{r.row.controller}, case {r.row.case}, {r.variant.gains} gains": r.parameters
        for r in results
        if r.variant.friction
    }
    claim_records = [claim.as_record() for claim in judged]
    record = {
        "provenance": provenance,
        "claims": claim_records,
        "cells": as_records(numbers),
        "chatter": [row._asdict() for row in chattering],
        "parameters": content,
    }
    title = "Table V: measured / printed (ratio)"
    (folder / f"{TABLE}.md").write_text(as_markdown(title, tables), "utf-8")
    (folder / f"{TABLE}.csv").write_text(as_csv(numbers), "utf-8")
    (folder / f"{TABLE}.json").write_text(json.dumps(record, indent=1) + "\n", "utf-8")
    page = template("space_robot.paper.reproduction", "report.html.j2").render(
        provenance=provenance,
        parameters={name: json.dumps(value, indent=1) for name, value in content.items()},
        claims=claims_table(claim_records),
        tables=tables,
        figure_groups=figure_groups(rows, figures),
        errata=(config_directory().parent / ERRATA).read_text("utf-8"),
    )
    (folder / "report.html").write_text(page, "utf-8")
    return record
