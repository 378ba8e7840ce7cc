"""The command ``space-robot new``: make a folder for a robot and fly it once."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

from .completed_names import names_in
from .options import BASE, REPAIR, flight_options

SECTION = "Robots, missions and own pieces"


@click.command()
@click.argument("robot", shell_complete=names_in("robots"))
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    metavar="DIR",
    help="Folder to make [default: the file's name, here].",
)
@BASE
@REPAIR
@click.option("--force", is_flag=True, help="Replace an older folder of this command.")
@flight_options("json")
def new(
    robot: str, out: Path | None, base: str | None, repair: bool, force: bool, as_json: bool
) -> None:
    """Make a folder for a robot: model, mission, gains for all laws; fly each law once.

    ROBOT is a URDF, a xacro (where xacro is installed), or a YAML file. The mission goes from rest
    to rest within the limits of the joints, the gains are those of `gains tune --h-bar auto`. Exit
    code 1 if a law could not fly with its gains; the folder is made nevertheless.

    \b
    Examples:
      space-robot new my.urdf
      space-robot new my.urdf --base satellite --repair --out my_robot
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
    command = shlex.join([*words, *(["--repair"] if repair else [])])
    texts, read = robot_texts(files.file, base, repair, command)
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
