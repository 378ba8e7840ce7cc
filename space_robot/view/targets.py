"""Targets in the scene: in free motion before their capture, then fixed to the gripper."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_model.robot.shapes import Colour, even_box
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.simulated_time import tick_from
from space_robot_sim.environment.events import Capture
from space_robot_sim.environment.grasp import Grasp

from ..analysis.described import events_of
from .free_body import FreeBody, before_capture
from .scene import RobotScene, SceneStyle, add_shape, set_pose
from .trails import Move

if TYPE_CHECKING:
    from viser import SceneApi

Array = NDArray[np.float64]

COLOUR: Colour = (0.85, 0.38, 0.22, 1.0)


def targets(
    scene: SceneApi, root: str, robot_scene: RobotScene, log: FlightLog, robot: Robot, times: Array
) -> list[Move]:
    """Draw each target of a flight as a box of uniform density; nothing without targets.

    Args:
        scene: of a server.
        root: name of the robot in the scene.
        robot_scene: the robot that holds it.
        log: the flight.
        robot: that flew.
        times: (K,) of the frames, s.
    """
    try:
        captures = [
            (event, Grasp.of(robot, event.target), after.time_s if after else np.inf)
            for event, after in pairwise([*events_of(log), None])
            if isinstance(event, Capture)
        ]
    except InputError:
        return []
    moves: list[Move] = []
    for number, (event, grasp, stop) in enumerate(captures):
        start = _first(times, event.time_s)
        moves.append(_holding(robot_scene, f"target_{number}", grasp, start, _first(times, stop)))
        free = before_capture(event, log, robot)
        if free is not None and start > 0:
            path = f"{root}/free_target_{number}"
            period = log.timebase.period
            moment = tick_from(event.time_s, period) * period
            moves.append(_drifting(scene, path, grasp, free, times[:start] - moment))
    return moves


def _holding(scene: RobotScene, name: str, grasp: Grasp, start: int, stop: int) -> Move:
    box = even_box(grasp.mass, grasp.inertia, grasp.com, grasp.body, COLOUR)
    shape = scene.add_shape(name, box)
    shape.visible = False

    def hold(k: int) -> None:
        if k in (start, stop):
            shape.visible = k == start

    return hold


def _drifting(scene: SceneApi, path: str, grasp: Grasp, free: FreeBody, times: Array) -> Move:
    """Draw a target until its capture, at ``times`` (K,) relative to it, s."""
    frame = scene.add_frame(path, show_axes=False)
    box = even_box(grasp.mass, grasp.inertia, np.zeros(3), 0, COLOUR)
    add_shape(scene, f"{path}/box", box, SceneStyle())
    positions, quaternions = free.poses(times)

    def drift(k: int) -> None:
        if k < len(times):
            set_pose(frame, "position", positions[k])
            set_pose(frame, "wxyz", quaternions[k])
        elif k == len(times):
            frame.visible = False

    return drift


def _first(times: Array, event: float) -> int:
    """Return the first frame at or after an event."""
    return int(np.searchsorted(times, event - 1e-9))
