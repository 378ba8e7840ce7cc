"""``space-robot soak``."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import click

from ..processes.interruption import Interrupted
from .numbers import FiniteRange
from .options import OUTPUT, folder_option, put_json


@click.command()
@click.option(
    "--minutes",
    type=FiniteRange(0.0, min_open=True),
    default=30.0,
    show_default=True,
    help="How long to begin new flights.",
)
@click.option(
    "--seed",
    type=click.IntRange(0),
    default=0,
    show_default=True,
    help="The same seed draws the same flights.",
)
@click.option(
    "--duration",
    type=FiniteRange(0.5, 1e4),
    default=5.0,
    show_default=True,
    help="Simulated seconds of each flight.",
)
@folder_option(
    "--bags", "New or empty folder to keep all bags [default: those of failed flights are kept]."
)
@click.option("--json", "as_json", is_flag=True, help="Print everything, each flight, as JSON.")
@OUTPUT
def soak(
    minutes: float,
    seed: int,
    duration: float,
    bags: Path | None,
    as_json: bool,
    output: Path | None,
) -> None:
    """Fly random missions with faults back to back on the real graph.

    Law, case, swaps and one to four faults of each flight are drawn from the seed; killed and
    stopped processes are among them. A flight survives if it comes to its end, no node dies that
    was not killed, every torque is finite, no message is lost that no fault explains, its bag can
    be read, and no process is left. Those that do not are listed, each with the command that flies
    it again. Exit code 0 if all survived, else 1. Ctrl-C shows what was flown so far (then 130).

    \b
    Examples:
      space-robot soak --minutes 480 --seed 7 --output soak.json
      space-robot soak --minutes 2 --duration 1 --json | jq '.each[] | select(.survived | not)'
    """
    if find_spec("psutil") is None:
        from space_robot_msgs_py.errors import InputError

        raise InputError("soak needs psutil: pip install 'space_robot[soak]'")
    from ..campaign.soak import soak as run
    from ..campaign.soak.display import print_soak
    from ..console.files import check_writable
    from ..console.terminal import terminal

    if output:
        check_writable(output)
    done = run(60.0 * minutes, seed, duration, bags, lambda line: click.echo(line, err=True))
    report = done.report()
    put_json(report, as_json, output)
    if not as_json:
        print_soak(report, terminal())
    if done.interrupted_by:
        raise Interrupted(done.interrupted_by)
    if failed := report["flights"] - report["survived"]:
        from space_robot_msgs_py.errors import FlightError

        raise FlightError(f"{failed} of {report['flights']} flights did not survive")
