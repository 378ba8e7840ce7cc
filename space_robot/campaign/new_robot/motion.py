"""A rest-to-rest mission for a new robot, within the limits of its joints.

Every joint starts at zero, or as near to it as its range allows, moves in one direction and then
back beyond its start, neighbours in opposite directions. The duration of the legs keeps velocity
and effort below a share of their limits: they scale with 1/T and 1/T^2.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from space_robot_control.guidance.mission import MissionSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.environment import EnvironmentSettings

from ...tuning.demand import demand

Array = NDArray[np.float64]

LEG_S = 10.0
"""The shortest duration of a leg, s."""
LONGEST_LEG_S = 600.0
TURN, SLIDE = math.radians(30.0), 0.25
"""Largest displacement of a joint from its start: rad, m."""
OF_THE_RANGE, OF_THE_LIMITS = 0.25, 0.5
"""Largest displacement as a share of the joint's range; largest velocity and effort as shares of
their limits."""
PEAK_VELOCITY = 1.875
"""Peak velocity of a rest-to-rest quintic, relative to its mean velocity."""


def rest_to_rest(robot: Robot) -> MissionSettings:
    """Return a mission for the actuated joints of ``robot``, the base's attitude held.

    Raises:
        InputError: the limits would need legs longer than `LONGEST_LEG_S`.
    """
    nominal = robot.nominal
    lower, upper, velocity, effort = (
        np.array(column) for column in zip(*robot.limits, strict=True)
    )
    most = np.where(robot.is_prismatic[: robot.n], SLIDE, TURN)
    way = np.minimum(most, OF_THE_RANGE * (upper - lower))
    start = np.clip(0.0, lower + way, upper - way)
    signs = np.where(np.arange(robot.n) % 2, -1.0, 1.0)
    points = np.array([start, start + signs * way, start - 0.5 * signs * way])
    longest = np.abs(np.diff(points, axis=0)).max(axis=0)
    leg = max(LEG_S, float(np.max(PEAK_VELOCITY * longest / (OF_THE_LIMITS * velocity))))
    asked = demand(nominal, _mission(robot, points, leg), [EnvironmentSettings()]).nominal[3:]
    leg *= max(1.0, math.sqrt(float(np.max(asked / (OF_THE_LIMITS * effort)))))
    leg = math.ceil(leg)
    if leg > LONGEST_LEG_S:
        raise InputError(
            f"robot {robot.name!r}: with its limits of velocity and effort the legs of a mission "
            f"would last {leg} s: write a mission by hand"
        )
    return _mission(robot, points, leg)


def mission_text(robot: Robot, mission: MissionSettings, command: str) -> str:
    """Return the text of a mission's file, one waypoint per line.

    Args:
        robot: whose joints the mission moves.
        mission: to be written.
        command: the user's command, for the header.
    """
    rows = np.reshape(mission.waypoints_deg, (-1, robot.n))
    lines = [f"[{', '.join(f'{value:g}' for value in row)}]" for row in rows.tolist()]
    joints = ", ".join(
        f"{name} (m)" if slides else name
        for name, slides in zip(robot.joint_names, robot.is_prismatic, strict=False)
    )
    waypoints = ",\n                    ".join(line[1:-1] for line in lines)
    times = ", ".join(f"{time:g}" for time in mission.waypoint_times)
    return (
        f"# Made by `{command}`: from rest to rest within the limits of the joints. Collisions\n"
        f"# are not checked. A line is a waypoint: {joints}.\n"
        "mission_node:\n"
        "  ros__parameters:\n"
        f"    waypoint_times: [{times}]\n"
        f"    waypoints_deg: [{waypoints}]\n"
        "plant_node:\n"
        "  ros__parameters:\n"
        f"    initial_joints_deg: {lines[0]}\n"
    )


def _mission(robot: Robot, points: Array, leg: float) -> MissionSettings:
    degrees = np.round(robot.to_degrees(points), 3)
    return MissionSettings(
        waypoint_times=[index * leg for index in range(len(points))],
        waypoints_deg=degrees.ravel().tolist(),
    )
