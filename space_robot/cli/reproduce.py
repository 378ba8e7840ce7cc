"""The command ``space-robot reproduce``."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .numbers import FiniteRange
from .options import flight_option

if TYPE_CHECKING:
    from space_robot_control.navigation.settings import NavigationMode

SECTION = "Gains and studies"


@click.command()
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    default=Path("reproduction"),
    show_default=True,
    help="Folder to write; an older reproduction is replaced.",
)
@click.option(
    "--only",
    multiple=True,
    metavar="CONTROLLER/CASE",
    help="Rows to fly, e.g. tde_stc/4-1; repeatable [default: all 17].",
)
@click.option(
    "--duration",
    type=FiniteRange(0.0, 1e6, min_open=True),
    help="Seconds to fly for a quick look [default: the mission's 30].",
)
@click.option(
    "--brief",
    is_flag=True,
    help="Only the gains each law flies by default, and figures as SVG only: half the time.",
)
@flight_option("sensors")
@flight_option("navigation")
@flight_option("actuators")
@click.option("--jobs", type=click.IntRange(1, 256), help="Processes [default: one a core].")
@click.option("--json", "as_json", is_flag=True, help="Print table_v.json.")
def reproduce(
    out: Path,
    only: tuple[str, ...],
    duration: float | None,
    brief: bool,
    sensors: str,
    navigation: NavigationMode | None,
    actuators: str,
    jobs: int | None,
    as_json: bool,
) -> None:
    """Fly Table V of the paper and compare; write tables, Figures 5 to 9, and a report.

    Every row is flown with the printed gains and the tuned ones, with the printed friction and
    without. Writes table_v.md, .csv and .json, figures/ (PNG and SVG) and report.html.

    \b
    Examples:
      space-robot reproduce
      space-robot reproduce --out table_v --only tde_stc/1 --only tde_smc/1
      space-robot reproduce --json | jq '.claims[] | [.text, .value, .holds]'
    """
    from space_robot_msgs_py.config.files import named_file

    from ..console.progress import counting_progress
    from ..flight.compilation import compile_kernels
    from ..paper.flights import ROWS, Equipment, TableRow
    from ..paper.reproduce import check_results_folder
    from ..paper.reproduce import reproduce as run
    from ..processes.executor import cores

    rows = [TableRow.parse(text) for text in dict.fromkeys(only)] or list(ROWS)
    check_results_folder(out)
    named_file("sensors", sensors)
    named_file("actuators", actuators)
    compile_kernels(actuators not in ("ideal", "none"))
    with counting_progress("flights") as progress:
        record = run(
            rows,
            out,
            duration=duration,
            brief=brief,
            equipment=Equipment(sensors, navigation or "direct", actuators),
            jobs=jobs or cores(),
            progress=progress,
        )
    if as_json:
        click.echo(json.dumps(record, indent=1))
    else:
        _summary(record, out)


def _summary(record: dict[str, Any], out: Path) -> None:
    from ..console.terminal import say, terminal
    from ..console.terminal_tables import print_table
    from ..paper.reproduce import claims_table

    console = terminal()
    if record["claims"]:
        print_table(claims_table(record["claims"]), console)
    diverged = {
        (cell["controller"], cell["gains"], cell["diverged_tick"])
        for cell in record["cells"]
        if cell["diverged_tick"] is not None
    }
    for controller, gains, tick in sorted(diverged):
        say(console, f"{controller} with {gains} gains diverges at tick {tick}")
    say(console, f"written to {out}/: report.html, table_v.md, table_v.csv, table_v.json, figures/")
