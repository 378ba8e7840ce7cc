"""The command ``space-robot urdf``: export a robot as a URDF."""

from __future__ import annotations

from pathlib import Path

import click

from .completed_names import names_in
from .options import BASE, REPAIR, file_option

SECTION = "Robots, missions and own pieces"


@click.command()
@click.argument("robot", default="paper", shell_complete=names_in("robots"))
@BASE
@REPAIR
@file_option("--out", help="Write it to a file, in place of standard output.")
def urdf(robot: str, base: str | None, repair: bool, out: Path | None) -> None:
    """Export a robot as a URDF, for RViz, Pinocchio, MuJoCo and other tools.

    ROBOT is a name, a URDF, a xacro (where xacro is installed), a YAML file or a folder. Frames
    are those of /tf: the base's is at its centre of mass, those of joints have the axis as z. What
    has no shapes gets some that are drawn from its joints and masses.

    \b
    Examples:
      space-robot urdf paper --out paper.urdf
      space-robot urdf my_robot/ --out my_robot.urdf
      space-robot urdf published.urdf --repair --base satellite --out mended.urdf
    """
    from space_robot_model.robot.find import robot_as_path, robot_source
    from space_robot_model.robot.urdf_text import urdf_text

    from ..console.files import write_text

    source = robot_source(robot_as_path(robot), base, repair)
    for line in source.findings:
        click.echo(f"repaired: {line}", err=True)
    text = urdf_text(source.robot)
    if out is None:
        click.echo(text, nl=False)
        return
    write_text(text, out, replace=True)
    click.echo(f"wrote {out}", err=True)
