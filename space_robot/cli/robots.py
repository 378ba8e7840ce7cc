"""The commands ``space-robot robot`` and ``urdf``: a robot's model shown, and as a URDF."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..console.tables import Column, Group, Table, named
from .option_types import names_in
from .options import BASE, REPAIR, file_option, flight_options

if TYPE_CHECKING:
    from space_robot_model.robot.urdf_xml import Finding


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
    from space_robot_model.robot.find import (
        URDF,
        read_robot_file,
        robot_as_path,
        robot_files,
        split_choice,
    )
    from space_robot_model.robot.urdf import read_urdf
    from space_robot_msgs_py.errors import InputError

    from ..console.files import write_text
    from ..console.terminal import echo_json, print_table, terminal

    _, own_base, is_repaired = split_choice(robot)
    base, repair = base or own_base, repair or is_repaired
    file = robot_files(robot_as_path(robot)).file
    is_urdf = file.suffix in URDF
    findings = read_urdf(file, base, repair=True).findings if is_urdf else ()
    defects = [asdict(finding) for finding in findings]
    if findings and not repair:
        if as_json:
            echo_json({"file": str(file), "defects": defects})
        else:
            print_table(_defects(findings, "what --repair does"), terminal())
        these = "a defect" if len(findings) == 1 else f"{len(findings)} defects"
        raise InputError(f"{file}: {these} to repair: --repair does so")
    source = read_robot_file(file, base, repair)
    if out:
        write_text(source.text, out, replace=True)
        click.echo(f"wrote {out}", err=True)
    # the URDF's own names of links
    description = describe(Robot.from_urdf(file, base, repair) if is_urdf else source.robot)
    if as_json:
        echo_json({"file": str(file), **description, "defects": defects})
    else:
        _print_robot(description, findings)


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


def _print_robot(description: dict[str, Any], findings: Sequence[Finding]) -> None:
    from ..console.terminal import print_table, say, terminal

    console, passive = terminal(), len(description["passive_names"])
    say(
        console,
        f"robot {description['name']}: {description['mass']:g} kg, "
        f"{len(description['joint_names'])} joints with a motor"
        f"{f', {passive} with a spring' if passive else ''}",
    )
    if findings:
        print_table(_defects(findings, "repaired"), console)
    for remark in description["remarks"]:
        say(console, f"warning: {remark}")
    for table in _tables(description):
        print_table(table, console)


def _defects(findings: Sequence[Finding], heading: str) -> Table:
    columns = Column("line", spec="d"), *map(named, ("part", "defect", "given", heading))
    rows = [[f.line, f.part, f.defect, f.value, f.repair] for f in findings]
    return Table.of("Defects", columns, rows)


def _tables(description: dict[str, Any]) -> Iterator[Table]:
    note = "With all that is fixed to it; its frame is its joint's, whose axis is z."
    columns = [named("body"), named("moved by"), Column("mass", "kg", ".6g"), Column("CoM", "m")]
    rows: list[list[Any]] = []
    for body in description["bodies"]:
        vectors = _vector(body["com"]), _vector(body["principal_moments"])
        rows.append([body["name"], body["joint"] or "-", body["mass"], *vectors])
    yield Table.of("Bodies", [*columns, Column("principal moments", "kg m2")], rows, note)

    joints = description["joints"]
    cells = {
        **{key: [joint[key] for joint in joints] for key in ("name", "kind", "parent")},
        "range": [_range(joint) for joint in joints],
        "velocity": [_limit(joint, "velocity") for joint in joints],
        "effort": [_limit(joint, "effort") for joint in joints],
        "friction": [_coefficients(joint["friction"]) for joint in joints],
        "spring": [_coefficients(joint.get("spring")) for joint in joints],
    }
    cells = {name: own for name, own in cells.items() if any(own)}
    note = (
        "In this order in all arrays. deg and N m, or m and N of prismatic joints; friction: "
        "Coulomb and viscous; spring: stiffness, damping and rest; -: not given."
    )
    columns = [named("joint"), named("kind"), named("parent"), *map(Column, [*cells][3:])]
    yield Table.of("Joints", columns, [*zip(*cells.values(), strict=True)], note)

    if rows := [_drive(joint) for joint in joints if "drive" in joint]:
        names = ("gear ratio", "rotor inertia", "reflected", "stiffness", "damping")
        note = (
            "Motors on the parent, behind a gear and a spring. Stiffness and damping on the "
            "link's side; reflected: the rotor's inertia there, times the ratio squared; encoder: "
            "the side that is measured."
        )
        columns = [named("joint"), *map(Column, names), named("encoder")]
        yield Table.of("Drives", columns, rows, note)

    columns = [named("tool"), named("body"), Column("place", "m")]
    rows = [
        [tool["name"], tool["body"], _vector(tool["position"])] for tool in description["tools"]
    ]
    yield Table.of("Tools", columns, rows, "The first one is that of tool_pose.")

    rows = []
    for shape in description["shapes"]:
        mesh = shape.get("mesh", "") + ("" if shape.get("found", True) else " (missing)")
        rows.append([shape["body"], shape["shape"], _vector(shape["size"]), mesh])
    if rows:
        columns = [named("body"), named("shape"), Column("size", "m"), named("mesh")]
        yield Table.of("Shapes", columns, rows)

    plates = description["plates"]
    if plates["count"]:
        columns = [named("body"), Column("plates", spec="d"), Column("area", "m2", ".4g")]
        rows = [[body["name"], body["count"], body["area"]] for body in plates["bodies"]]
        total = ["together", plates["count"], plates["area"]]
        origin = "those of the file" if plates["source"] == "file" else "made from the shapes"
        note = f"For drag and sunlight in orbit: {origin}."
        yield Table("Plates", columns, [Group(rows), Group([total])], [note])


def _unit(joint: dict[str, Any]) -> tuple[float, str]:
    return (1.0, "m") if joint["kind"] == "prismatic" else (180.0 / math.pi, "deg")


def _range(joint: dict[str, Any]) -> str | None:
    limits, (factor, unit) = joint.get("limits", {}), _unit(joint)
    ends = [factor * limits.get(end, math.inf) for end in ("lower", "upper")]
    if not any(map(math.isfinite, ends)):
        return None
    return f"{ends[0]:.5g} to {ends[1]:.5g} {unit}"


def _limit(joint: dict[str, Any], name: str) -> str | None:
    value, (factor, unit) = joint.get("limits", {}).get(name, math.inf), _unit(joint)
    if not math.isfinite(value):
        return None
    if name == "velocity":
        return f"{factor * value:.5g} {unit}/s"
    return f"{value:.5g} {'N' if unit == 'm' else 'N m'}"


def _coefficients(values: dict[str, float] | None) -> str | None:
    return ", ".join(f"{value:.4g}" for value in values.values()) if values else None


def _drive(joint: dict[str, Any]) -> list[str]:
    drive, slides = joint["drive"], joint["kind"] == "prismatic"
    return [
        joint["name"],
        f"{drive['gear_ratio']:.5g}{' rad/m' if slides else ''}",
        f"{drive['rotor_inertia']:.4g} kg m2",
        f"{drive['reflected_inertia']:.4g} {'kg' if slides else 'kg m2'}",
        f"{drive['stiffness']:.4g} {'N/m' if slides else 'N m/rad'}",
        f"{drive['damping']:.4g} {'N s/m' if slides else 'N m s/rad'}",
        drive["encoder"],
    ]


def _vector(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.4g}" for value in values)
