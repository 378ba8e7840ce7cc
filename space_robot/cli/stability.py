"""The command ``space-robot stability``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .numbers import FiniteRange
from .options import flight_options, folder_option

if TYPE_CHECKING:
    from space_robot_msgs_py.bag.flight_log import FlightLog

    from ..flight.plan import Flight

SECTION = "Gains and studies"


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
