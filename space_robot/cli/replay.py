"""The command ``space-robot replay``."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .option_types import FiniteRange
from .options import bag_options, file_option, flight_option


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option(
    "--controller", default="", help="Law to answer, or file.py:Class [default: the one that flew]."
)
@click.option("--gains", default="", help="Its gains [default: those flown].")
@flight_option("set")
@click.option(
    "--start",
    type=FiniteRange(0.0),
    default=0.0,
    metavar="T",
    help="Simulated time to begin at, s.",
)
@click.option(
    "--end",
    type=FiniteRange(0.0, min_open=True),
    metavar="T",
    help="Simulated time to end before, s.",
)
@file_option("--csv", "table", help="File for both torques of every tick.")
@file_option("--plot", help="Picture of both torques by axis, as PNG and SVG.")
@bag_options
@flight_option("json")
def replay(
    bag: Path,
    parameters: dict[str, dict[str, Any]],
    start: float,
    end: float | None,
    table: Path | None,
    plot: Path | None,
    as_json: bool,
    **options: Any,
) -> None:
    """Answer the states of a recorded flight anew and compare the commands.

    A controller with the recorded law and gains gets the recorded states and references, in this
    process and as fast as it answers; every command is compared to the last bit. Exit code 0: all
    are equal and none is missing; 1: a command differs or is missing, and the first difference is
    shown; 2: invalid input.

    With another --controller or other --gains, equality is not expected: the command shows
    what they would have commanded on the same history (open loop), with exit code 0.

    Modules and files that a bag names are not opened without --trust.

    \b
    Examples:
      space-robot replay flights/one
      space-robot replay flights/one --set controller.tde_stc.k_1=[40.0]
      space-robot replay flights/one --controller ctc --plot ctc_instead.png
      space-robot replay flights/one --start 5 --end 10 --json
    """
    import math

    from space_robot_msgs_py.errors import FlightError, InputError

    from ..console.files import check_writable
    from ..console.terminal import echo_json, terminal
    from ..flight.replay.run import replay as run
    from . import replay_display as display

    if other := sorted(set(parameters) - {"controller"}):
        raise InputError(f"--set {other[0]}.…: a replay has no {other[0]}, only the controller")
    if end is not None and end <= start:
        raise InputError(f"--end {end:g} is not after --start {start:g}")
    for file in filter(None, (table, plot and plot.with_suffix(".png"))):
        check_writable(file)
    done = run(
        bag,
        parameters=parameters.get("controller", {}),
        start_s=start,
        end_s=math.inf if end is None else end,
        **options,
    )
    report, period = done.report(), done.recording.timebase.period
    if table:
        display.write_csv(done.comparison, period, table)
    if plot:
        from ..analysis.figures.style import save_figure  # slow to import

        figure = display.torque_figure(done.comparison, period, display.title(report))
        save_figure(figure, plot.with_suffix(""))
    if as_json:
        echo_json(report)
    else:
        display.print_replay(report, terminal())
    if done.error:
        raise done.error
    if not done.has_passed:
        raise FlightError(display.verdict(report))
