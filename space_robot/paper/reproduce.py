"""Runs the complete reproduction: flights, comparison, figures, folder of results."""

from __future__ import annotations

import json
import platform
import shutil
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from matplotlib.figure import Figure

from space_robot.analysis.report import template
from space_robot_msgs_py.config.installation import config_directory
from space_robot_msgs_py.errors import InputError

from ..analysis import figures as drawn
from ..analysis.figures.base_torque import BaseTorque
from ..analysis.figures.figure_set import FigureFolder, SavedFigure
from ..console.files import csv_writer
from ..console.tables import as_markdown
from ..flight.flown_log import empty_log
from ..flight.plan import Flight, Scenario, resolve
from ..processes.executor import run_all
from ..processes.software import commit, versions
from .comparison import Cell, cells, chatter, chatter_table, claims, claims_table, variant_tables
from .flights import PERFECT, ROBOT, Equipment, Result, TableRow, Variant, fly, plan

TABLE = "table_v"
ERRATA = "docs/explanation/errata.md"
"""Located beside ``config``, in the source tree and in an installation."""
FULL_DURATION = 30.0
"""Duration of the mission of Table V, s."""
MISSION = "figure5_desired_joints"
COMPARISONS: dict[str, tuple[str, Callable[[Mapping[str, BaseTorque]], Figure]]] = {
    "chatter": ("Chatter of the base torque in case 1", drawn.chatter),
    "junctions": ("Base torque at the junction of the two motions, case 1", drawn.junctions),
}
"""Caption and drawing function of the figures of all laws, by file name."""
FIGURE_OF_CASE = {"1": "6", "2": "7", "3": "8", "4-1": "9a", "4-2": "9b"}


def check_results_folder(folder: Path) -> None:
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
    check_results_folder(folder)
    if not Flight(resolve(Scenario(actuators=equipment.actuators))).controls_base:
        raise InputError(
            f"actuators {equipment.actuators}: Table V has attitude errors and base torques, so "
            "the base needs attitude actuators"
        )
    folder.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(dir=folder.parent, prefix=".reproduce-") as temporary:
        work = Path(temporary) / folder.name
        figures = FigureFolder(work / "figures", png=not brief)
        figures.path.mkdir(parents=True)
        planned = list(plan(rows, brief))
        order = sorted(planned, key=lambda flight: flight[0].shown != flight[1])  # longest first
        fly_one = partial(_fly, duration=duration, figures=figures, equipment=equipment)
        flown = dict(zip(order, run_all(fly_one, order, jobs, progress), strict=True))
        results = [flown[flight] for flight in planned]
        if torques := {r.row.controller: r.base_torque for r in results if r.base_torque}:
            log = empty_log(Flight(resolve(Scenario(robot=ROBOT, duration=duration))))
            figures.save(drawn.desired_joints(log), MISSION)
            for stem, (_, draw) in COMPARISONS.items():
                figures.save(draw(torques), stem)
        provenance = {
            "commit": commit(),
            "versions": versions(),
            "machine": f"{platform.system()} {platform.machine()}",
            "duration_s": duration or FULL_DURATION,
            "brief": brief,
            **equipment._asdict(),
        }
        record = _write(rows, results, provenance, figures)
        if folder.exists():
            shutil.rmtree(folder)
        work.rename(folder)
    return record


def _fly(
    flight: tuple[TableRow, Variant],
    duration: float | None,
    figures: FigureFolder,
    equipment: Equipment,
) -> Result:
    return fly(*flight, duration, figures, equipment)


def _write(
    rows: Sequence[TableRow],
    results: Sequence[Result],
    provenance: dict[str, Any],
    figures: FigureFolder,
) -> dict[str, Any]:
    folder, comparison, chattering = figures.path.parent, cells(results), chatter(results)
    tables = [*variant_tables(comparison), chatter_table(chattering)]
    record: dict[str, Any] = {
        "provenance": provenance,
        "claims": [claim.as_record() for claim in claims(results, comparison)],
        "cells": [cell._asdict() for cell in comparison],
        "chatter": chattering,
        "parameters": {
            f"{r.row.controller}, case {r.row.case}, {r.variant.gains} gains": r.parameters
            for r in results
            if r.variant.friction
        },
    }
    title = "Table V: measured / printed (ratio)"
    (folder / f"{TABLE}.md").write_text(as_markdown(title, tables), "utf-8")
    with csv_writer(folder / f"{TABLE}.csv") as writer:
        writer.writerows([Cell._fields, *comparison])
    (folder / f"{TABLE}.json").write_text(json.dumps(record, indent=1) + "\n", "utf-8")
    page = template("space_robot.paper", "report.html.j2").render(
        provenance=provenance,
        parameters={
            name: json.dumps(value, indent=1) for name, value in record["parameters"].items()
        },
        claims=claims_table(record["claims"]),
        tables=tables,
        figure_groups=_figure_groups(rows, figures),
        errata=(config_directory().parent / ERRATA).read_text("utf-8"),
    )
    (folder / "report.html").write_text(page, "utf-8")
    return record


def _figure_groups(rows: Sequence[TableRow], folder: FigureFolder) -> dict[str, list[SavedFigure]]:
    """Return the drawn figures by heading: the mission's first, then by case."""
    groups = {
        "The mission, and comparison of the laws": [
            (MISSION, "Figure 5: desired joint angles"),
            *((stem, caption) for stem, (caption, _) in COMPARISONS.items()),
        ]
    }
    for case, number in FIGURE_OF_CASE.items():
        groups[f"Case {case}"] = [
            (row.stem, f"Figure {number}: {row.controller}, {row.shown.title}")
            for row in rows
            if row.case == case
        ]
    return {title: files for title, g in groups.items() if (files := folder.saved(g))}
