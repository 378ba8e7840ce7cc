"""The complete reproduction: flights, compared with Table V and claims, in a folder of results."""

from __future__ import annotations

import json
import platform
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

from matplotlib.figure import Figure

from space_robot_msgs_py.config.installation import config_directory
from space_robot_msgs_py.errors import InputError

from ..analysis import figures as drawn
from ..analysis.figures.base_torque import BaseTorque
from ..analysis.figures.figure_set import FigureFolder, SavedFigure
from ..analysis.report import template
from ..console.files import csv_writer
from ..console.tables import Column, JudgedCell, Table, as_markdown, named
from ..flight.flown_log import empty_log
from ..flight.plan import Flight, Scenario, resolve
from ..processes.executor import run_all
from ..processes.software import commit, versions
from .flights import (
    CHATTER,
    COLUMNS,
    DEFINITIONS,
    HEADINGS,
    PERFECT,
    PRINTED,
    ROBOT,
    TORQUE,
    TRACKING,
    VARIANTS,
    Equipment,
    Result,
    TableRow,
    fly,
    plan,
)

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
CASE_FIGURES = {"1": "6", "2": "7", "3": "8", "4-1": "9a", "4-2": "9b"}
TDE_LAWS = ("tde_smc", "tde_tsmc", "tde_stc")
SMOOTHER = "TDE-STC is smoother, printed gains, ideal sensors: base torque's total variation, "
SMOOTHNESS = {
    ("tde_tsmc", "printed"): (f"{SMOOTHER}tde_tsmc / tde_stc", 5.0),
    ("tde_smc", "printed"): (f"{SMOOTHER}tde_smc / tde_stc", 100.0),
    ("tde_tsmc", "tuned"): (
        "TDE-STC is the smoothest TDE law whatever the gains: tde_tsmc tuned / tde_stc",
        1.0,
    ),
}
"""The paper's claims on other laws' variation, relative to that of TDE-STC: text, smallest."""


class Cell(NamedTuple):
    """One number of Table V and the measured value."""

    controller: str
    case: str
    gains: str
    friction: bool
    definition: str
    column: str
    measured: float | None
    """Measured value; None if the flight diverged."""
    printed: float
    ratio: float | None
    diverged_tick: int | None

    @property
    def text(self) -> str:
        """``measured / printed (ratio)``."""
        if self.measured is None or self.ratio is None:
            return f"diverged at tick {self.diverged_tick}"
        spec = ".4f" if "torque" in self.column else ".2e"
        ratio = f"{self.ratio:.3f}" if self.ratio > 0.01 else f"{self.ratio:.1e}"
        return f"{self.measured:{spec}} / {self.printed:{spec}} ({ratio})"


def compare_with_table(results: Iterable[Result]) -> list[Cell]:
    """Compare every flight with Table V in every column, by both definitions."""
    cells = []
    for row, variant, _, diverged_tick, metrics, _ in results:
        for definition in DEFINITIONS:
            for column, printed in zip(COLUMNS, PRINTED[row], strict=True):
                measured = metrics[f"{column}.{definition}"] if metrics else None
                ratio = None if measured is None else measured / printed
                numbers = measured, printed, ratio, diverged_tick
                cells.append(Cell._make((*row, *variant, definition, column, *numbers)))
    return cells


def variant_tables(comparison: Sequence[Cell]) -> Iterator[Table]:
    """Tabulate each variant and definition."""
    columns = named("controller"), named("case"), *(Column(*own) for own in HEADINGS.values())
    for definition, meaning in DEFINITIONS.items():
        for variant in VARIANTS:
            rows: dict[tuple[str, str], list[str]] = {}
            for cell in comparison:
                if (cell.gains, cell.friction, cell.definition) == (*variant, definition):
                    row = cell.controller, cell.case
                    rows.setdefault(row, [*row]).append(cell.text)
            if rows:
                yield Table.of(f"{variant.title}; {meaning}", columns, list(rows.values()))


def chatter_table(flights: Iterable[dict[str, Any]]) -> Table:
    """Tabulate the chatter of flights, as `reproduce` returns it."""
    names = ("base", "joints 1-3", "joints 4-6")
    columns = (
        *map(named, ("controller", "gains")),
        *(Column(f"{name}: variation", "N m/s", ".3g") for name in names),
        *(Column(f"{name}: power > 100 Hz", spec=".1e") for name in names),
    )
    rows = [
        [x["controller"], x["gains"], *(x[key][column] for key in CHATTER for column in TORQUE)]
        for x in flights
    ]
    return Table.of("Chatter in case 1, printed friction", columns, rows)


class Claim(NamedTuple):
    """A claim of the paper as an inequality between ``value`` and ``limit``."""

    text: str
    value: float
    relation: str
    """``<=`` or ``>=``."""
    limit: float

    @property
    def holds(self) -> bool:
        """True if the inequality is met."""
        return self.value <= self.limit if self.relation == "<=" else self.value >= self.limit


def claims_table(records: Iterable[dict[str, Any]]) -> Table:
    """Tabulate claims, as `reproduce` returns them, each with its verdict."""
    columns = named("claim"), Column("measured", spec=".4g"), Column("limit"), named()
    rows = [
        [
            c["text"],
            c["value"],
            f"{c['relation']} {c['limit']:g}",
            JudgedCell.of(c["holds"], "holds", "fails"),
        ]
        for c in records
    ]
    return Table.of("", columns, rows)


def judge_claims(results: Iterable[Result], comparison: Iterable[Cell]) -> list[Claim]:
    """Return every claim whose flights are among the results."""
    return [
        Claim(text, max(values), relation, limit)
        for text, values, relation, limit in _judged(results, comparison)
        if values
    ]


def _judged(
    results: Iterable[Result], comparison: Iterable[Cell]
) -> Iterator[tuple[str, list[float], str, float]]:
    """Yield text, values of which the largest counts, relation and limit of each claim."""
    cells = [c for c in comparison if (c.definition, c.gains) == ("rms", "printed") and c.ratio]
    free = [c for c in cells if c.controller == "tde_stc" and not c.friction]
    rubbing = [c for c in cells if c.controller in TDE_LAWS and c.friction]
    text = "TDE-STC's torques are Table V's, friction-free: largest relative difference"
    yield text, [abs((c.ratio or 0.0) - 1.0) for c in free if c.column in TORQUE], "<=", 0.01
    text = "The TDE laws track closer than printed in every cell: largest measured / printed"
    yield text, [c.ratio or 0.0 for c in rubbing if c.column in TRACKING], "<=", 1.0
    variation = {
        (r.row.controller, r.variant.gains): r.chatter["variation"]["base_torque"]
        for r in results
        if r.chatter
    }
    own = variation.get(("tde_stc", "printed"))
    for law, (text, factor) in SMOOTHNESS.items():
        yield text, [variation[law] / own] if own and law in variation else [], ">=", factor
    for words, flown in (("with friction", rubbing), ("friction-free", free)):
        errors = {(c.case, c.column): c.measured for c in flown if c.controller == "tde_stc"}
        for case in ("4-1", "4-2"):
            pairs = [(errors.get((case, name)), errors.get(("1", name))) for name in TRACKING]
            growth = [heavy / light for heavy, light in pairs if heavy and light]
            text = "Payload and disturbance hardly degrade TDE-STC, no error doubles, "
            yield f"{text}{words}: case {case} / 1", growth, "<=", 2.0


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
    """Fly ``rows``, write table, figures and report into ``folder``, and return the JSON's content.

    The folder is written atomically at the end; an older reproduction is replaced.

    Args:
        rows: of Table V.
        folder: of the results.
        duration: of the flights, s (None: 30 s, as in Table V).
        brief: fly only what Table V needs, see `plan`; figures as SVG only.
        equipment: sensors, navigation and actuators; Table V assumes ideal ones.
        jobs: number of processes.
        progress: called with the number of flights; returns a function to call after each one.

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
        figures = FigureFolder(work / "figures", ("svg",) if brief else ("png", "svg"))
        figures.path.mkdir(parents=True)
        planned = list(plan(rows, brief))
        order = sorted(planned, key=lambda flight: flight[0].shown != flight[1])  # longest first
        fly_one = partial(fly, duration=duration, figures=figures, equipment=equipment)
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


def _write(
    rows: Sequence[TableRow],
    results: Sequence[Result],
    provenance: dict[str, Any],
    figures: FigureFolder,
) -> dict[str, Any]:
    folder, comparison = figures.path.parent, compare_with_table(results)
    judged = judge_claims(results, comparison)
    record: dict[str, Any] = {
        "provenance": provenance,
        "claims": [{**claim._asdict(), "holds": claim.holds} for claim in judged],
        "cells": [cell._asdict() for cell in comparison],
        "chatter": [
            {"controller": r.row.controller, "gains": r.variant.gains, **r.chatter}
            for r in results
            if r.chatter
        ],
        "parameters": {
            f"{r.row.controller}, case {r.row.case}, {r.variant.gains} gains": r.parameters
            for r in results
            if r.variant.friction
        },
    }
    tables = [*variant_tables(comparison), chatter_table(record["chatter"])]
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
    for case, number in CASE_FIGURES.items():
        groups[f"Case {case}"] = [
            (row.stem, f"Figure {number}: {row.controller}, {row.shown.title}")
            for row in rows
            if row.case == case
        ]
    return {title: files for title, g in groups.items() if (files := folder.saved(g))}
