"""Goals of the tool in a scene: its pose wherever the mission comes to rest."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from space_robot_msgs_py.bag.flight_log import FlightLog

from ..analysis.tool_path import Poses
from ..analysis.waypoints import waypoint_ticks

if TYPE_CHECKING:
    from viser import SceneApi

MOST = 50
"""Goals that are drawn of a flight."""


def goals(scene: SceneApi, root: str, log: FlightLog, wanted: Poses, size: float) -> None:
    """Draw axes at the wanted poses of the first tool where the mission comes to rest.

    Args:
        scene: of a server.
        root: name of the robot in the scene.
        log: the flight.
        wanted: its poses, see `wanted_poses`.
        size: length of the axes, m.
    """
    rows, (orientations, positions) = waypoint_ticks(log)[:MOST], wanted
    if not len(rows):
        return
    turns = Rotation.from_matrix(orientations[rows]).as_quat()
    for number, (position, turn) in enumerate(zip(positions[rows], turns, strict=True)):
        scene.add_frame(
            f"{root}/goal_{number}",
            axes_length=size,
            axes_radius=0.04 * size,
            wxyz=np.roll(turn, 1),
            position=position,
        )
