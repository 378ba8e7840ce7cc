"""The commands ``space-robot reproduce`` and ``stability``: the paper's results and proofs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .option_types import FiniteRange
from .options import flight_option, flight_options, folder_option

if TYPE_CHECKING:
    from space_robot_control.navigation.settings import NavigationMode
    from space_robot_msgs_py.bag.flight_log import FlightLog

    from ..flight.plan import Flight


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
@flight_options("sensors", "navigation", "actuators")
@click.option("--jobs", type=click.IntRange(1, 256), help="Processes [default: one a core].")
@flight_option("json")
def reproduce(
    out: Path,
    only: tuple[str, ...],
    sensors: str,
    navigation: NavigationMode | None,
    actuators: str,
    jobs: int | None,
    as_json: bool,
    **options: Any,
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
            equipment=Equipment(sensors, navigation or "direct", actuators),
            jobs=jobs or cores(),
            progress=progress,
            **options,
        )
    if as_json:
        click.echo(json.dumps(record, indent=1))
    else:
        _summary(record, out)


def _summary(record: dict[str, Any], out: Path) -> None:
    from ..console.terminal import print_table, say, terminal
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


@click.command()
@flight_options(
    *("controller", "case", "gains", "robot", "mission", "orbit", "duration", "friction", "json")
)
@click.option(
    "--initial-error",
    type=FiniteRange(0.0, 0.1, min_open=True),
    default=1e-3,
    show_default=True,
    help="Error of every axis at the start of the reaching flight (joints: rad).",
)
@folder_option("--plot", help="Folder for the Nyquist plot and V(t), as PNG and SVG.")
def stability(initial_error: float, as_json: bool, plot: Path | None, **options: Any) -> None:
    """Check the paper's stability conditions on a flight: Section III-C, Appendices A and B.

    Flies the case as planned, without friction, and from an initial error; measures the
    time-delay error and its derivative, and reports whether each condition holds.

    \b
    Examples:
      space-robot stability
      space-robot stability --case 4-2 --json
      space-robot stability --gains tuned --plot figures
    """
    from space_robot_msgs_py.config.validation import validate

    from ..console.files import make_folder
    from ..console.terminal import echo_json, terminal
    from ..flight.compilation import compile_kernels
    from ..flight.plan import Scenario
    from ..paper.stability import study
    from ..paper.stability_report import print_study, report

    plan = validate(Scenario, options, "options")
    if plot:
        make_folder(plot)
    compile_kernels()
    proofs = study(plan, initial_error, _fly)
    if plot:
        from ..paper.stability_figures import draw

        written = draw(proofs, plot)
        names = ", ".join(map(str, written)) or "nothing: the figures are of K_1 and K_2"
        click.echo(f"wrote {names}", err=True)
    if as_json:
        echo_json(report(proofs))
    else:
        print_study(proofs, terminal())


def _fly(flight: Flight, which: str) -> FlightLog:
    from ..console.progress import flight_progress
    from ..flight.simulate import simulate

    with flight_progress(flight.ticks * flight.period, flight.controller.law.name) as show:
        return simulate(flight, None, lambda tick: show(tick * flight.period, which))
