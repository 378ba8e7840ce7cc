"""The command ``space-robot robot``: show the model read from a robot's file."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import click

from .completed_names import names_in
from .options import BASE, REPAIR, file_option, flight_options

SECTION = "Robots, missions and own pieces"


@click.command()
@click.argument("robot", default="paper", shell_complete=names_in("robots"))
@BASE
@REPAIR
@file_option("--out", help="Write all numbers as a robot's YAML, to edit it or to fly it.")
@flight_options("json")
def robot(robot: str, base: str | None, repair: bool, out: Path | None, as_json: bool) -> None:
    """Show the bodies, joints, drives, tools, shapes, plates and defects of a robot.

    ROBOT is a name, a URDF, a xacro (where xacro is installed), a YAML file or a folder. A URDF
    with defects is not read unless they are repaired: they are listed, with exit code 2.

    \b
    Examples:
      space-robot robot my.urdf
      space-robot robot my.urdf --repair --out robot.yaml
      space-robot robot my.urdf --base satellite --json
      space-robot robot seven_joint
    """
    from space_robot_model.robot import Robot
    from space_robot_model.robot.description import describe
    from space_robot_model.robot.find import URDF, read_robot_file, robot_as_path, robot_files
    from space_robot_model.robot.urdf import read_urdf
    from space_robot_msgs_py.errors import InputError

    from ..console.files import whole_file
    from ..console.terminal import echo_json, terminal
    from .robot_display import print_defects, print_robot

    file = robot_files(robot_as_path(robot)).file
    is_urdf = file.suffix in URDF
    findings = read_urdf(file, base, repair=True).findings if is_urdf else ()
    if findings and not repair:
        if as_json:
            echo_json({"file": str(file), "defects": [asdict(finding) for finding in findings]})
        else:
            print_defects(findings, terminal())
        these = "a defect" if len(findings) == 1 else f"{len(findings)} defects"
        raise InputError(f"{file}: {these} to repair: --repair does so")
    source = read_robot_file(file, base, repair)
    if out:
        with whole_file(out, replace=True) as written:
            written.write(source.text.encode())
        click.echo(f"wrote {out}", err=True)
    # the URDF's own names of links
    description = describe(Robot.from_urdf(file, base, repair) if is_urdf else source.robot)
    if as_json:
        echo_json({"file": str(file), **description, "defects": [asdict(f) for f in findings]})
    else:
        print_robot(description, findings, terminal())
