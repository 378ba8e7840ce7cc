"""The command ``space-robot new``: a folder for a robot, or a template of a user's own piece."""

from __future__ import annotations

import math
import shlex
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

from . import new_files
from .choose import search_options
from .gains import WORDS, TypedCommand
from .option_types import NumberList, names_in
from .options import BASE, REPAIR, flight_options

if TYPE_CHECKING:
    from space_robot_model.robot.urdf import Mount


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


def _mount(
    on: Path | None,
    mass: float | None,
    inertia: list[float] | None,
    at: list[float] | None,
    rpy_deg: list[float] | None,
) -> Mount | None:
    """Return the satellite of an arm; None: the robot has one."""
    from space_robot_model.robot.inertia import check_inertia
    from space_robot_model.robot.urdf import Mount

    if on and (mass is not None or inertia):
        raise click.UsageError("a satellite is --on a URDF, or has --base-mass and --base-inertia")
    if (mass is None) != (inertia is None):
        raise click.UsageError("--base-mass and --base-inertia need one another")
    if not on and mass is None:
        if at or rpy_deg:
            raise click.UsageError("--at and --rpy-deg need --on, or --base-mass")
        return None
    if mass is not None and not 0.0 < mass <= 1e12:
        raise click.BadParameter(
            f"a number above 0 was expected, got {mass:g}", param_hint="--base-mass"
        )
    try:
        inertia = check_inertia(inertia) if inertia else []
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="--base-inertia") from None
    rpy = [math.radians(angle) for angle in rpy_deg or (0.0, 0.0, 0.0)]
    return Mount(on, mass or 0.0, inertia, at or (0.0, 0.0, 0.0), rpy)


@click.group(cls=NewGroup)
def new() -> None:
    """Make a folder for a robot, or a template: a law, sensors, a metric, a mission.

    A template is a commented file that flies at once, and its tests.

    \b
    Examples:
      space-robot new my.urdf                 model, mission, the best law and its gains
      space-robot new law my_law              a control law with its gains
      space-robot new sensor my_sensors       sensors, with the numbers of data sheets
      space-robot new metric overshoot        a number of a flight, for analyze and campaigns
      space-robot new mission inspect         a motion in segments
    """


@new.command("robot", cls=TypedCommand, short_help="Make a folder for a robot, and choose its law.")
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
@click.option(
    "--on",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="URDF",
    help="Mount the robot, an arm on a fixed base, on the root of this satellite.",
)
@click.option(
    "--base-mass",
    type=float,
    metavar="KG",
    help="Mount the robot, an arm on a fixed base, on a satellite of this mass.",
)
@click.option(
    "--base-inertia",
    type=NumberList(3, 6),
    metavar="IXX,IYY,IZZ[,IXY,IXZ,IYZ]",
    help="Inertia of that satellite about its centre of mass, kg m2.",
)
@click.option(
    "--at",
    type=NumberList(3),
    metavar="X,Y,Z",
    help="Where the arm's root is on the satellite's, m [default: 0,0,0].",
)
@click.option(
    "--rpy-deg",
    type=NumberList(3),
    metavar="R,P,Y",
    help="Roll, pitch, yaw of the arm's root on the satellite, degrees [default: 0,0,0].",
)
@click.option("--force", is_flag=True, help="Replace an older folder of this command.")
@search_options(evaluations=48, runs=8)
@flight_options("json")
@click.pass_context
def new_robot(
    context: click.Context,
    /,
    robot: str,
    out: Path | None,
    base: str | None,
    repair: bool,
    passive: dict[str, dict[str, float]],
    on: Path | None,
    base_mass: float | None,
    base_inertia: list[float] | None,
    at: list[float] | None,
    rpy_deg: list[float] | None,
    force: bool,
    laws: tuple[str, ...],
    evaluations: int,
    runs: int,
    workers: int | None,
    as_json: bool,
) -> None:
    """Make a folder for a robot: model, mission, the law that flies it best, and its gains.

    ROBOT is a URDF, a xacro (where xacro is installed), or a YAML file. The mission goes from rest
    to rest within the limits of the joints, slow enough for usual wheels. For each law some gains
    are tried in flights with friction and sensors, from those of `gains tune` on; the law with the
    least errors becomes the robot's default. `space-robot choose` does the same for your own
    hardware and mission, and looks longer. Exit code 1 if no law flies; the folder is made
    nevertheless. The word ``robot`` may be left out.

    \b
    Examples:
      space-robot new my.urdf
      space-robot new my.urdf --base satellite --repair --out my_robot
      space-robot new my.urdf --passive left_hinge:15,0.05 --passive right_hinge:15,0.05
      space-robot new arm.urdf --on satellite.urdf --at 0.5,0,0.6 --rpy-deg 0,90,0
      space-robot new arm.urdf --base-mass 300 --base-inertia 60,50,40 --at 0,0,0.6
      space-robot fly --robot my_robot --controller ctc
    """
    from space_robot_model.robot.find import robot_as_path, robot_files, split_choice
    from space_robot_msgs_py.errors import SpaceRobotError

    from ..choice.new_robot import SHORT, check_replaceable, make_robot
    from ..choice.report import candidates_table
    from ..choice.robot_files import CAMPAIGN_FILE, robot_texts
    from ..console.terminal import echo_json, print_table, terminal
    from ..flight.compilation import compile_lanes
    from ..processes.executor import cores

    if base_inertia:
        base_inertia = [*base_inertia, 0.0, 0.0, 0.0][:6]
    chosen = split_choice(robot)
    robot, base, repair = chosen.name, base or chosen.base, repair or chosen.repair
    files = robot_files(robot_as_path(robot))
    command = shlex.join(["space-robot", "new", *context.meta[WORDS]])
    mount = _mount(on, base_mass, base_inertia, at, rpy_deg)
    texts, read = robot_texts(files.file, base, repair, command, passive, mount)
    for line in read.repairs:
        click.echo(f"repaired: {line}", err=True)
    folder = out or Path(files.name)
    check_replaceable(folder, force, texts)
    compile_lanes()
    workers = cores() if workers is None else workers
    options = replace(SHORT, laws=laws, evaluations=evaluations, runs=runs, workers=workers)
    made = make_robot(texts, read, folder, command, options)
    said = f"made {folder}/"
    if made.choice.law:
        said += f": `space-robot fly --robot {folder}/` flies it, "
        said += f"`space-robot campaign run {folder}/{CAMPAIGN_FILE}` the best laws in more draws"
    click.echo(said, err=True)
    if as_json:
        echo_json(made.report())
    else:
        print_table(candidates_table(made.choice, made.remarks), terminal())
    if not made.choice.law:
        raise SpaceRobotError(f"no law flies {folder}/: see the table")


for command in (new_files.law, new_files.sensor, new_files.metric, new_files.mission):
    new.add_command(command)
