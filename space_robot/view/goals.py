"""Goals of the tool in a scene: its pose wherever the mission comes to rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from space_robot_msgs_py.bag.flight_log import FlightLog

from ..analysis.tool_error import wanted_poses
from ..analysis.waypoints import waypoint_ticks

if TYPE_CHECKING:
    from viser import SceneApi

MOST = 50
"""Goals that are drawn of a flight."""


def goals(scene: SceneApi, root: str, log: FlightLog, size: float) -> None:
    """Draw axes at the wanted poses of the first tool; nothing for a mission of waypoints only.

    Args:
        scene: of a server.
        root: name of the robot in the scene.
        log: the flight.
        size: length of the axes, m.
    """
    poses = wanted_poses(log)
    rows = waypoint_ticks(log)[:MOST]
    if poses is None or not len(rows):
        return
    orientations, positions = poses
    turns = Rotation.from_matrix(orientations[rows]).as_quat()
    for number, (position, turn) in enumerate(zip(positions[rows], turns, strict=True)):
        scene.add_frame(
            f"{root}/goal_{number}",
            axes_length=size,
            axes_radius=0.04 * size,
            wxyz=np.roll(turn, 1),
            position=position,
        )
