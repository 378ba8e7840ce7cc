"""The command ``space-robot choose``: which law to fly, with its evidence."""

from __future__ import annotations

import shlex
from functools import reduce
from pathlib import Path
from typing import Any

import click

from .gains import MASS_UNCERTAINTY, WORDS, TypedCommand
from .option_types import FiniteRange, names_in
from .options import WORKERS, Decorator, flight_options, folder_option


def search_options(evaluations: int, runs: int) -> Decorator:
    """Return the options of a search for the best law, with their defaults."""
    options = (
        click.option(
            "--law",
            "laws",
            multiple=True,
            metavar="LAW",
            help="A law that takes part, also file.py:Class=GAINS of your own; may be repeated "
            "[default: all].",
        ),
        click.option(
            "--evaluations",
            type=click.IntRange(1, 100_000),
            default=evaluations,
            show_default=True,
            help="Gain sets to fly for each law; 1: the first one alone.",
        ),
        click.option(
            "--runs",
            type=click.IntRange(2, 100_000),
            default=runs,
            show_default=True,
            help="Draws that every law flies with its best gains.",
        ),
        WORKERS,
    )
    return lambda command: reduce(lambda inner, option: option(inner), reversed(options), command)


@click.command(cls=TypedCommand)
@click.argument("robot", default="paper", shell_complete=names_in("robots"))
@flight_options(
    *("mission", "case", "sensors", "navigation", "actuators", "orbit", "duration", "period"),
    *("friction", "set", "json"),
)
@click.option(
    "--for",
    "criterion",
    type=click.Choice(["tracking", "pointing", "tool", "wheels"]),
    default="tracking",
    show_default=True,
    help="What counts: errors of attitude and joints, the attitude's, the tool's, or least wear of "
    "the wheels with errors near the least.",
)
@click.option(
    "--ripple",
    type=FiniteRange(0.0, 10.0, min_open=True),
    default=0.05,
    show_default=True,
    help="Largest ripple of a torque, RMS above 2 Hz, as a share of the largest that the mission "
    "asks.",
)
@search_options(evaluations=80, runs=12)
@click.option("--seed", type=click.IntRange(0), default=1, show_default=True, help="Of all draws.")
@MASS_UNCERTAINTY
@folder_option("--out", help="Folder to write [default: ROBOT/choice, choices/ROBOT if shipped].")
@click.pass_context
def choose(
    context: click.Context,
    /,
    robot: str,
    as_json: bool,
    criterion: str,
    laws: tuple[str, ...],
    mass_uncertainty: float,
    workers: int | None,
    out: Path | None,
    **options: Any,
) -> None:
    """Find the law and the gains that fly a robot best.

    For each law the gains with the least error at each ripple of the torques are searched, over
    trials with a light and a heavy robot (masses, torque scale, friction, latency); then each law
    flies the mission with its best gains, all with the same draws. The folder has a page with the
    fronts, the gains of each law, JSON, and a campaign that goes on with the best. A robot of your
    own flies the law found, with its gains, from then on. Ten minutes for a robot with seven joints
    on two cores; more --evaluations find better gains, more --runs tell nearer laws apart.

    \b
    Examples:
      space-robot choose my_robot/ --sensors fine --navigation filtered --actuators small_wheels
      space-robot choose ets_vii --orbit ets_vii --for pointing
      space-robot choose paper --case 3 --law tde_stc --law indi --evaluations 60
      space-robot choose my_robot/ --law my_law.py:MyLaw=my_law.yaml --law ctc
    """
    from space_robot_control.laws import laws as shipped_laws
    from space_robot_model.robot.find import OWN_GAINS, robot_as_path, robot_files
    from space_robot_msgs_py.errors import SpaceRobotError

    from ..choice import ChoiceOptions, Uncertainty, recommend
    from ..choice.new_robot import CHOICE
    from ..choice.report import candidates_table, report, write_report
    from ..choice.robot_files import CAMPAIGN_FILE
    from ..console.terminal import echo_json, print_table, terminal
    from ..flight.compilation import compile_lanes
    from ..processes.executor import cores

    wanted = ChoiceOptions(
        criterion=criterion,
        laws=laws,
        workers=cores() if workers is None else workers,
        uncertainty=Uncertainty(mass=mass_uncertainty),
        **{name: options.pop(name) for name in ("ripple", "evaluations", "runs", "seed")},
    )
    scenario = {"robot": robot_as_path(robot)} | {
        name: value for name, value in options.items() if value not in (None, {}, "")
    }
    files = robot_files(scenario["robot"])
    own_folder = files.file.parent
    is_own = files.gains == own_folder / OWN_GAINS
    folder = out or (own_folder / CHOICE if is_own else Path("choices") / files.name)
    command = shlex.join(["space-robot", "choose", *context.meta[WORDS]])
    if scenario.get("sensors", "ideal") == "ideal":
        click.echo("warning: ideal sensors, see --sensors fine --navigation filtered", err=True)
    compile_lanes()
    choice = recommend(scenario, folder, wanted, command)
    page = write_report(choice, folder, command)
    is_default = is_own and choice.law in shipped_laws()
    chosen = choice.install(folder, own_folder / OWN_GAINS) if is_default else None
    if as_json:
        echo_json(report(choice))
    else:
        print_table(candidates_table(choice), terminal())
        click.echo(choice.sentence)
    if chosen:
        click.echo(f"{robot} flies {choice.law} with gains {chosen} from now on", err=True)
    elif choice.law:
        controller = choice.order[0].candidate.controller
        click.echo(f"to fly it: --controller {controller} --gains {folder / choice.law}/", err=True)
    click.echo(f"{page} has the fronts", err=True)
    if not choice.law:
        raise SpaceRobotError(f"no law flies {robot}: see the table")
    click.echo(f"{folder / CAMPAIGN_FILE} goes on with the best laws", err=True)
