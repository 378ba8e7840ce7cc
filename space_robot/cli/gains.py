"""The command ``space-robot gains``: check and tune gain sets."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import click

from .option_types import FiniteRange, names_in
from .options import flight_options, folder_option

WORDS = f"{__name__}.words"
MASS_UNCERTAINTY = click.option(
    "--mass-uncertainty",
    type=FiniteRange(0.0, 0.9),
    default=0.2,
    show_default=True,
    help="Share by which each mass and inertia may be wrong.",
)


@click.group()
def gains() -> None:
    """Check a gain set before a flight, or make one."""


@gains.command()
@click.option(
    "--controller",
    default="all",
    show_default=True,
    shell_complete=names_in("gains/paper/tuned", ["all"]),
    help="A law's name, or file.py:Class of your own; all: every law that the gain set has.",
)
@MASS_UNCERTAINTY
@flight_options(
    *("case", "gains", "robot", "plant_robot", "mission", "sensors", "actuators", "orbit"),
    *("navigation", "seed", "set", "json"),
)
def check(as_json: bool, mass_uncertainty: float, **options: Any) -> None:
    """Compute the margin and noise gain of each law of a gain set along a mission.

    For laws with time-delay estimation: the eigenvalues of H_S^-1 h_bar, also with wrong masses,
    the radius of E - H_S^-1 h_bar, the share by which the torque reported may exceed the one
    commanded (for laws with an observer: the same share, by their closed loop). For all laws:
    whether small motions of the closed loop grow; the torque that noise on the measured rates
    becomes; with --sensors, the ripple of the torque while the robot is held still for some
    seconds. With --actuators none the inertia is that of the joints of a robot whose base floats
    freely. For a robot with gears: frequencies of their springs, and whether small oscillations
    grow. Exit code 1 if anything grows under any of the laws; a margin below 2 % is a remark.

    \b
    Examples:
      space-robot gains check
      space-robot gains check --controller tde_stc --gains my_gains/
      space-robot gains check --sensors fine --navigation filtered
      space-robot gains check --actuators none
      space-robot gains check --case 4-2 --set controller.tde_stc.h_bar='[200.]'
    """
    from space_robot_msgs_py.errors import SpaceRobotError

    from ..console.terminal import echo_json, terminal
    from .gains_check import check_laws, gains_report, print_checks

    checks = check_laws(options, mass_uncertainty)
    if as_json:
        echo_json(gains_report(checks))
    else:
        print_checks(checks, terminal())
    for line in checks.remarks:
        click.echo(line, err=True)
    if not checks.is_stable:
        raise SpaceRobotError("; ".join(checks.faults))


class TypedCommand(click.Command):
    """A command that keeps the words with which it was started."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the words after the command's name."""
        ctx.meta[WORDS] = tuple(args)
        return super().parse_args(ctx, args)


@gains.command(cls=TypedCommand)
@flight_options(
    *("robot", "mission", "orbit", "sensors", "actuators", "navigation", "period", "set")
)
@click.option(
    "--case",
    "cases",
    multiple=True,
    default=["1"],
    show_default=True,
    metavar="CASE",
    help="A case that is to be flown, with its payload; may be repeated, without --law.",
)
@click.option(
    "--law",
    metavar="LAW",
    help="Search the gains of this law by flights, also file.py:Class=GAINS of your own "
    "[default: all laws, by the method].",
)
@click.option(
    "--ripple",
    type=FiniteRange(0.0, 10.0, min_open=True),
    metavar="SHARE",
    help="Ripple of a torque, RMS, as a share of the largest that the mission asks. With --law: "
    "least error with at most this [default: 0.05]; else by noise alone [default: 0.1].",
)
@click.option(
    "--error",
    type=FiniteRange(0.0, 10.0, min_open=True),
    metavar="ERROR",
    help="With --law: least ripple with at most this geometric mean of the RMS errors of attitude, "
    "degrees, and joints, rad or m.",
)
@click.option(
    "--bandwidth",
    type=FiniteRange(0.0, 1e4, min_open=True),
    metavar="W",
    help="Poles, rad/s [default: with --law searched, else what lag and ripple allow].",
)
@click.option(
    "--evaluations",
    type=click.IntRange(1, 100_000),
    default=160,
    show_default=True,
    help="With --law: gain sets to try.",
)
@click.option(
    "--margin",
    type=FiniteRange(0.0, 0.5, min_open=True),
    default=0.05,
    show_default=True,
    help="Share by which the torque reported may exceed the one commanded.",
)
@MASS_UNCERTAINTY
@click.option(
    "--h-bar",
    "h_bar",
    type=click.Choice(["constant", "nominal"]),
    default="constant",
    show_default=True,
    help="Without --law, inertia of the laws with time-delay estimation: a constant diagonal, or "
    "H_S of the nominal model.",
)
@folder_option("-o", "--output", required=True, help="Folder of the set, for --gains.")
@click.pass_context
def tune(
    context: click.Context,
    /,
    output: Path,
    law: str | None,
    cases: tuple[str, ...],
    ripple: float | None,
    error: float | None,
    bandwidth: float | None,
    evaluations: int,
    margin: float,
    mass_uncertainty: float,
    h_bar: str,
    **options: Any,
) -> None:
    """Make a gain set: for all laws by a method, or for one law by flights.

    The method flies nothing. It takes h_bar from the inertia along the mission, so that the
    time-delay estimate contracts with the margin asked for, whichever of the masses are wrong; a
    low-pass for it; poles below its lag; switching gains from the errors that are left. Sensors and
    navigation are listened to on a robot at rest. space_robot/tuning/method.py has it.

    With --law the front of one law is searched from there on, in flights with a light and a heavy
    robot, as `space-robot choose` does for all: the least error with a ripple, the least ripple
    with an error, or the best other gains for poles of your own.

    \b
    Examples:
      space-robot gains tune -o my_gains
      space-robot gains tune --sensors fine --navigation filtered -o my_gains
      space-robot gains tune --robot seven_joint --case 1 --case 2 --margin 0.03 -o my_gains
      space-robot gains tune --law dob --sensors fine --navigation filtered --ripple 0.03 -o my_dob
      space-robot fly --gains my_gains
    """
    from ..campaign.gain_set import tuned_set, write_set
    from ..console.terminal import terminal
    from ..tuning.gain_file import estimate_remark
    from ..tuning.task import TuningOptions

    command = shlex.join(["space-robot", "gains", "tune", *context.meta[WORDS]])
    if law is not None:
        from ..choice import ChoiceOptions, Uncertainty, tune_law
        from ..flight.compilation import compile_lanes

        if len(cases) > 1:
            raise click.UsageError("--law flies one --case")
        searched = ChoiceOptions(
            ripple=ripple or 0.05,
            error=error,
            bandwidth=bandwidth,
            laws=(law,),
            evaluations=evaluations,
            uncertainty=Uncertainty(mass=mass_uncertainty, torque_scale=margin),
        )
        compile_lanes()
        score = tune_law({**options, "case": cases[0]}, output, searched, command).score
        click.echo(
            f"wrote {output}: in trials error {score.error:.3g}, ripple {score.ripple:.2%}",
            err=True,
        )
        return
    if error is not None:
        raise click.UsageError("--error needs --law: it is reached by flights")
    wanted = TuningOptions(margin, mass_uncertainty, bandwidth, ripple or 0.1, h_bar)
    with terminal(stderr=True).status("tuning") as status:
        tuned = tuned_set(options, cases, wanted, status.update)
    for path in write_set(tuned, command, output):
        click.echo(f"wrote {path}", err=True)
    if remark := estimate_remark(tuned):
        click.echo(remark, err=True)
