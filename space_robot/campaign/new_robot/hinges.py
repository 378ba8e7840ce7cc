"""Joints of a URDF that are probably hinges of panels: URDF cannot say that these have no motor."""

from __future__ import annotations

import math

import yaml

from space_robot_model.robot import Robot

FREQUENCY_HZ, DAMPING_RATIO = 0.5, 0.005
"""Of the springs that are proposed, as of a large solar panel."""


def hinges(robot: Robot) -> dict[str, dict[str, float]]:
    """Return stiffness, N m/rad, and damping, N m s/rad, of the joints that may be hinges.

    They are the revolute joints that carry a single body on the base, with no tool, of a robot
    that has an arm of more joints beside them.
    """
    if max(robot.branches) < 2:
        return {}
    hinges = {}
    for joint, name in enumerate(robot.joint_names):
        body = joint + 1
        is_alone = robot.parent[joint] == 0 and body not in robot.parent
        if is_alone and not robot.is_prismatic[joint] and robot.tool.body != body:
            x, y, _ = robot.com[body]
            inertia = float(robot.inertia[body][2, 2] + robot.mass[body] * (x * x + y * y))
            rate = 2.0 * math.pi * FREQUENCY_HZ
            values = inertia * rate**2, 2.0 * DAMPING_RATIO * inertia * rate
            stiffness, damping = (float(f"{value:.2g}") for value in values)
            hinges[name] = {"stiffness": stiffness, "damping": damping}
    return hinges


def hinge_remark(robot: Robot) -> str:
    """Return a proposal to make hinges passive; empty if there are none."""
    names = hinges(robot)
    if not names:
        return ""
    flow = yaml.safe_dump(
        {"passive": names}, default_flow_style=True, sort_keys=False, width=math.inf
    )
    return (
        f"{', '.join(names)}: each carries one body on the base. If that is a panel on a hinge "
        f"without a motor, add to `robot:` in robot.yaml `{flow.strip()[1:-1]}` (springs of "
        f"{FREQUENCY_HZ:g} Hz: yours may be others), and give that file to `space-robot new`."
    )
