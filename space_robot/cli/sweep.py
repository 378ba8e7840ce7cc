"""``space-robot sweep``: laws beside one another over grades of sensors and sets of actuators."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .numbers import FiniteRange
from .options import OUTPUT, flight_options, folder_option, put_json

GRADES = ("ideal", "fine", "tactical", "coarse")


@click.command()
@click.option(
    "--law",
    "laws",
    multiple=True,
    metavar="LAW[=GAINS]",
    help="Law with its gain set, by name or path; repeatable [default: the five laws].",
)
@click.option(
    "--sensors",
    multiple=True,
    metavar="NAME",
    help="Sensors of config/sensors, or a path; repeatable "
    "[default: ideal, fine, tactical, coarse; with --actuators: ideal].",
)
@click.option(
    "--actuators",
    multiple=True,
    metavar="NAME",
    help="Actuators of config/actuators, or a path; repeatable [default: ideal].",
)
@click.option(
    "--draws",
    type=click.IntRange(1, 100_000),
    default=1,
    show_default=True,
    help="Flights of every law with all hardware.",
)
@click.option(
    "--spread",
    type=FiniteRange(0.0, 1.0, max_open=True),
    default=0.0,
    show_default=True,
    help="Largest relative error of the plant's masses and inertias; no law is told.",
)
@click.option("--seed", type=click.IntRange(0, 2**30), default=0, help="Seed of the draws.")
@click.option("--jobs", type=click.IntRange(1, 256), help="Processes [default: one a core].")
@folder_option(
    "--out", help="Folder for table.csv, summary.md and the figure; an older sweep's are replaced."
)
@flight_options(
    "case",
    "robot",
    "mission",
    "duration",
    "navigation",
    "command_latency_ticks",
    "friction",
    "events",
    "set",
    "json",
)
@OUTPUT
def sweep(
    laws: tuple[str, ...],
    sensors: tuple[str, ...],
    actuators: tuple[str, ...],
    draws: int,
    spread: float,
    seed: int,
    jobs: int | None,
    out: Path | None,
    as_json: bool,
    output: Path | None,
    **common: Any,
) -> None:
    """Fly every law with all sensors and actuators, and compare errors and ripple.

    Errors are those of the truth. All laws fly the same draws of masses and noise. Exit code 0
    also if flights diverge: the table says how many.

    \b
    Examples:
      space-robot sweep --navigation filtered
      space-robot sweep --law tde_stc --law tde_tsmc=tuned --sensors white_l1 --case 3
      space-robot sweep --draws 15 --spread 0.2 --out sweep --json
      space-robot sweep --actuators ideal --actuators wheels --actuators thrusters --actuators none
    """
    from space_robot_control.laws import laws as all_laws

    from ..analysis.figures.style import save_figure
    from ..campaign.sweep import sweep as run
    from ..campaign.sweep import sweep_study
    from ..campaign.sweep.summary import as_records, cells, figure, row_record, summary_table
    from ..console.files import check_writable, make_folder, whole_file
    from ..console.progress import counting_progress
    from ..console.tables import Column, Table, as_csv, as_markdown
    from ..console.terminal import terminal
    from ..console.terminal_tables import print_table
    from ..processes.pool import cores

    study = sweep_study(
        list(dict.fromkeys(laws or sorted(all_laws()))),
        list(dict.fromkeys(sensors or (("ideal",) if actuators else GRADES))),
        list(dict.fromkeys(actuators or ("ideal",))),
        draws,
        spread,
        common,
    )
    if out:
        make_folder(out)
        for name in ("table.csv", "summary.md", "sweep.png", "sweep.svg"):
            check_writable(out / name)
    with counting_progress("flights") as progress:
        rows = run(study, seed, jobs or cores(), progress)
    swept = cells(rows)
    table = summary_table(swept)
    if out:
        records = [row_record(row) for row in rows]
        names = list(dict.fromkeys(name for record in records for name in record))
        flights = Table.of(
            "", [Column(name) for name in names], [[r.get(n) for n in names] for r in records]
        )
        summary = as_markdown("Laws over sensors and actuators", [table])
        for name, text in (("table.csv", as_csv(flights)), ("summary.md", summary)):
            with whole_file(out / name, replace=True) as file:
                file.write(text.encode())
        save_figure(figure(swept), out / "sweep")
    if failed := [row for row in rows if not row.is_complete]:
        task, reason = failed[0].task, failed[0].reason
        first = f"the first, run {task.run} under {task.law}: {reason}"
        click.echo(f"{len(failed)} of {len(rows)} flights failed, {first}", err=True)
    put_json({"cells": as_records(swept)}, as_json, output)
    if not as_json:
        print_table(table, terminal())
