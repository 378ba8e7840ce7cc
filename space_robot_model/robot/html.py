"""A robot as a table for notebooks: bodies, joints and limits."""

from __future__ import annotations

import math
from collections.abc import Iterator

from space_robot_msgs_py.config.text import html_table

from .tree import TreeArrays

HEADS = ("body", "mass, kg", "moved by", "on", "range", "velocity", "effort")


def robot_html(robot: TreeArrays) -> str:
    """Return the table of a robot: a row per body, with the joint that moves it."""
    passive = len(robot.passive_names)
    words = [
        f"{robot.name}: {float(robot.mass.sum()):g} kg",
        f"{robot.n} joints with a motor",
        *([f"{passive} with a spring"] if passive else []),
        *([f"tools: {', '.join(tool.name for tool in robot.tools)}"] if robot.tools else []),
    ]
    return html_table(HEADS, _rows(robot), ", ".join(words))


def _rows(robot: TreeArrays) -> Iterator[list[str]]:
    yield [robot.body_names[0], f"{robot.mass[0]:.6g}", *[""] * 5]
    for number, joint in enumerate(robot.all_joint_names):
        yield [
            robot.body_names[number + 1],
            f"{robot.mass[number + 1]:.6g}",
            joint,
            robot.body_names[robot.parent[number]],
            *_limits(robot, number),
        ]


def _limits(robot: TreeArrays, number: int) -> list[str]:
    """Return range, velocity and effort of a joint; empty where there is no limit."""
    if number >= robot.n:
        return ["", "", "passive, with a spring"]
    factor, unit, force = (
        (1.0, "m", "N") if robot.is_prismatic[number] else (180.0 / math.pi, "deg", "N m")
    )
    limits = robot.limits[number]
    ends = [factor * limits.lower, factor * limits.upper]
    return [
        f"{ends[0]:.5g} to {ends[1]:.5g} {unit}" if any(map(math.isfinite, ends)) else "",
        f"{factor * limits.velocity:.5g} {unit}/s" if math.isfinite(limits.velocity) else "",
        f"{limits.effort:.5g} {force}" if math.isfinite(limits.effort) else "",
    ]
