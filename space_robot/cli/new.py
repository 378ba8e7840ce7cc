"""The command ``space-robot new``: a folder for a robot, or a template of a user's own piece."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from pathlib import Path

import click
from click.shell_completion import CompletionItem

from . import new_files
from .completed_names import names_in
from .options import BASE, REPAIR, flight_options

SECTION = "Robots, missions and own pieces"


class NewGroup(click.Group):
    """Group whose command ``robot`` needs no name: ``new my.urdf``."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse the arguments, with ``robot`` before those that name no command."""
        is_named = not args or args[0] in (*self.commands, *ctx.help_option_names)
        return super().parse_args(ctx, args if is_named else ["robot", *args])

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of a name, or ``robot`` for a robot's file."""
        return self.commands.get(cmd_name, self.commands["robot"])

    def list_commands(self, ctx: click.Context) -> Sequence[str]:  # type: ignore[override]
        """Return the commands, the robot first."""
        return list(self.commands)

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Complete the names of commands and of robots."""
        robot = self.commands["robot"].params[0]
        return [*super().shell_complete(ctx, incomplete), *robot.shell_complete(ctx, incomplete)]


def _springs(
    context: click.Context, option: click.Parameter, texts: Sequence[str]
) -> dict[str, dict[str, float]]:
    """Parse `JOINT:STIFFNESS,DAMPING`, several times."""
    springs: dict[str, dict[str, float]] = {}
    for text in texts:
        joint, _, numbers = text.rpartition(":")
        try:
            stiffness, damping = map(float, numbers.split(","))
        except ValueError:
            joint = ""
        if not joint or not (0.0 <= stiffness < math.inf and 0.0 <= damping < math.inf):
            raise click.BadParameter(
                f"JOINT:STIFFNESS,DAMPING was expected, with numbers of 0 or more, got {text!r}"
            )
        if joint in springs:
            raise click.BadParameter(f"{joint} occurs twice")
        springs[joint] = {"stiffness": stiffness, "damping": damping}
    return springs


@click.group(cls=NewGroup)
def new() -> None:
    """Make a folder for a robot, or a template: a law, sensors, a metric, a mission.

    A template is a commented file that flies at once, and its tests.

    \b
    Examples:
      space-robot new my.urdf                 model, mission, gains for all laws; a first flight
      space-robot new law my_law              a control law with its gains
      space-robot new sensor my_sensors       sensors, with the numbers of data sheets
      space-robot new metric overshoot        a number of a flight, for analyze and campaigns
      space-robot new mission inspect         a motion in segments
    """


@new.command("robot", short_help="Make a folder for a robot, and fly it.")
@click.argument("robot", shell_complete=names_in("robots"))
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Folder to make [default: the file's name, here].",
)
@BASE
@REPAIR
@click.option(
    "--passive",
    multiple=True,
    callback=_springs,
    metavar="JOINT:STIFFNESS,DAMPING",
    help="A spring instead of a motor in a joint, such as the hinge of a panel: N m/rad and "
    "N m s/rad, or N/m and N s/m if it slides; may be repeated.",
)
@click.option("--force", is_flag=True, help="Replace an older folder of this command.")
@flight_options("json")
def new_robot(
    robot: str,
    out: Path | None,
    base: str | None,
    repair: bool,
    passive: dict[str, dict[str, float]],
    force: bool,
    as_json: bool,
) -> None:
    """Make a folder for a robot: model, mission, gains for all laws; fly each law once.

    ROBOT is a URDF, a xacro (where xacro is installed), or a YAML file. The mission goes from rest
    to rest within the limits of the joints, the gains are those of `gains tune --h-bar auto`. The
    law with the least errors and ripple with friction and sensors becomes the robot's default. Exit
    code 1 if a law could not fly with its gains; the folder is made nevertheless. The word
    ``robot`` may be left out.

    \b
    Examples:
      space-robot new my.urdf
      space-robot new my.urdf --base satellite --repair --out my_robot
      space-robot new my.urdf --passive left_hinge:15,0.05 --passive right_hinge:15,0.05
      space-robot fly --robot my_robot --controller ctc
    """
    from space_robot_model.robot.find import robot_as_path, robot_files
    from space_robot_msgs_py.errors import SpaceRobotError

    from ..campaign.new_robot import check_replaceable, make_robot, robot_texts
    from ..campaign.new_robot.display import rms_table
    from ..campaign.new_robot.texts import CAMPAIGN_FILE
    from ..console.terminal import echo_json, terminal
    from ..console.terminal_tables import print_table
    from ..flight.compilation import compile_kernels

    files = robot_files(robot_as_path(robot))
    words = ["space-robot", "new", robot, *(["--base", base] if base else [])]
    words += ["--repair"] if repair else []
    for joint, spring in passive.items():
        words += ["--passive", f"{joint}:{spring['stiffness']:.12g},{spring['damping']:.12g}"]
    command = shlex.join(words)
    texts, read = robot_texts(files.file, base, repair, command, passive)
    for line in read.repairs:
        click.echo(f"repaired: {line}", err=True)
    folder = out or Path(files.name)
    check_replaceable(folder, force, texts)
    compile_kernels()
    with terminal(stderr=True).status("reading") as status:
        made = make_robot(texts, read, folder, command, status.update)
    click.echo(
        f"made {folder}/: `space-robot fly --robot {folder}/` flies it, "
        f"`space-robot campaign run {folder}/{CAMPAIGN_FILE}` with dispersed masses",
        err=True,
    )
    if as_json:
        echo_json(made.report())
    else:
        print_table(rms_table(made), terminal())
    if failed := [law for law, flown in made.flights.items() if flown.failure]:
        raise SpaceRobotError(
            f"{', '.join(failed)}: {made.flights[failed[0]].failure}: the gains are of {folder}"
        )


for command in (new_files.law, new_files.sensor, new_files.metric, new_files.mission):
    new.add_command(command)
