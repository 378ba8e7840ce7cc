"""Tables of a robot's bodies, joints, drives, tools, shapes and plates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from rich.console import Console

from space_robot_model.robot.urdf_xml import Finding

from ..console.tables import Column, Group, Table
from ..console.terminal import say
from ..console.terminal_tables import print_table


def print_robot(description: dict[str, Any], findings: Sequence[Finding], console: Console) -> None:
    """Print the description made by `space_robot_model.robot.description.describe`."""
    passive = len(description["passive_names"])
    say(
        console,
        f"robot {description['name']}: {description['mass']:g} kg, "
        f"{len(description['joint_names'])} joints with a motor"
        f"{f', {passive} with a spring' if passive else ''}",
    )
    if findings:
        print_defects(findings, console, are_repaired=True)
    for remark in description["remarks"]:
        say(console, f"warning: {remark}")
    print_table(_bodies(description), console)
    print_table(_joints(description), console)
    if any("drive" in joint for joint in description["joints"]):
        print_table(_drives(description), console)
    print_table(_tools(description), console)
    if description["shapes"]:
        print_table(_shapes(description), console)
    if description["plates"]["count"]:
        print_table(_plates(description), console)


def print_defects(
    findings: Sequence[Finding], console: Console, are_repaired: bool = False
) -> None:
    """Print defects of a URDF with their repairs."""
    columns = [
        Column("line", spec="d"),
        *(Column(name, is_label=True) for name in ("part", "defect", "given")),
        Column("repaired" if are_repaired else "what --repair does", is_label=True),
    ]
    rows = [[f.line, f.part, f.defect, f.value, f.repair] for f in findings]
    print_table(Table.of("Defects", columns, rows), console)


def _bodies(description: dict[str, Any]) -> Table:
    columns = [
        Column("body", is_label=True),
        Column("moved by", is_label=True),
        Column("mass", "kg", ".6g"),
        Column("CoM", "m"),
        Column("principal moments", "kg m2"),
    ]
    rows = [
        [
            body["name"],
            body["joint"] or "-",
            body["mass"],
            _vector(body["com"]),
            _vector(body["principal_moments"]),
        ]
        for body in description["bodies"]
    ]
    note = "With all that is fixed to it; its frame is its joint's, whose axis is z."
    return Table("Bodies", columns, [Group(rows)], [note])


def _joints(description: dict[str, Any]) -> Table:
    joints = description["joints"]
    columns = {
        "joint": [joint["name"] for joint in joints],
        "kind": [joint["kind"] for joint in joints],
        "parent": [joint["parent"] for joint in joints],
        "range": [_range(joint) for joint in joints],
        "velocity": [_limit(joint, "velocity") for joint in joints],
        "effort": [_limit(joint, "effort") for joint in joints],
        "friction": [_coefficients(joint["friction"]) for joint in joints],
        "spring": [_coefficients(joint.get("spring")) for joint in joints],
    }
    shown = {name: cells for name, cells in columns.items() if any(cells)}
    heads = [Column(name, is_label=name in ("joint", "kind", "parent")) for name in shown]
    note = (
        "In this order in all arrays. deg and N m, or m and N of prismatic joints; friction: "
        "Coulomb and viscous; spring: stiffness, damping and rest; -: not given."
    )
    return Table("Joints", heads, [Group(list(zip(*shown.values(), strict=True)))], [note])


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


def _coefficients(description: dict[str, float] | None) -> str | None:
    return ", ".join(f"{value:.4g}" for value in description.values()) if description else None


def _drives(description: dict[str, Any]) -> Table:
    columns = [
        Column("joint", is_label=True),
        Column("gear ratio"),
        *(Column(name) for name in ("rotor inertia", "reflected", "stiffness", "damping")),
        Column("encoder", is_label=True),
    ]
    rows = []
    for joint in description["joints"]:
        if drive := joint.get("drive"):
            slides = joint["kind"] == "prismatic"
            stiffness = "N/m" if slides else "N m/rad"
            rows.append(
                [
                    joint["name"],
                    f"{drive['gear_ratio']:.5g}{' rad/m' if slides else ''}",
                    f"{drive['rotor_inertia']:.4g} kg m2",
                    f"{drive['reflected_inertia']:.4g} {'kg' if slides else 'kg m2'}",
                    f"{drive['stiffness']:.4g} {stiffness}",
                    f"{drive['damping']:.4g} {'N s/m' if slides else 'N m s/rad'}",
                    drive["encoder"],
                ]
            )
    note = (
        "Motors on the parent, behind a gear and a spring. Stiffness and damping on the link's "
        "side; reflected: the rotor's inertia there, times the ratio squared; encoder: the side "
        "that is measured."
    )
    return Table("Drives", columns, [Group(rows)], [note])


def _tools(description: dict[str, Any]) -> Table:
    columns = [Column("tool", is_label=True), Column("body", is_label=True), Column("place", "m")]
    rows = [
        [tool["name"], tool["body"], _vector(tool["position"])] for tool in description["tools"]
    ]
    return Table("Tools", columns, [Group(rows)], ["The first one is that of tool_pose."])


def _shapes(description: dict[str, Any]) -> Table:
    columns = [
        Column("body", is_label=True),
        Column("shape", is_label=True),
        Column("size", "m"),
        Column("mesh", is_label=True),
    ]
    rows = [
        [
            seen["body"],
            seen["shape"],
            _vector(seen["size"]),
            seen.get("mesh", "") + ("" if seen.get("found", True) else " (missing)"),
        ]
        for seen in description["shapes"]
    ]
    return Table.of("Shapes", columns, rows)


def _plates(description: dict[str, Any]) -> Table:
    plates = description["plates"]
    columns = [Column("body", is_label=True), Column("plates", spec="d"), Column("area", "m2")]
    rows = [[body["name"], body["count"], f"{body['area']:.4g}"] for body in plates["bodies"]]
    total = ["together", plates["count"], f"{plates['area']:.4g}"]
    note = (
        "For drag and sunlight in orbit: "
        f"{'those of the file' if plates['source'] == 'file' else 'made from the shapes'}."
    )
    return Table("Plates", columns, [Group(rows), Group([total])], [note])


def _vector(values: Sequence[float]) -> str:
    return ", ".join(f"{value:.4g}" for value in values)
