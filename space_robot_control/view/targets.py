"""What a robot has captured, drawn in its hand for as long as it is held."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.events import Capture
from space_robot_sim.environment.grasp import Grasp
from space_robot_sim.robot import Robot
from space_robot_sim.robot.shapes import Colour, even_box

from ..analysis.described import events_of
from .scene import RobotScene
from .trails import Move

Array = NDArray[np.float64]

COLOUR: Colour = (0.85, 0.38, 0.22, 1.0)


def held_targets(scene: RobotScene, log: FlightLog, robot: Robot, times: Array) -> list[Move]:
    """Draw each target of a flight as a box of even density; none where the bag tells none.

    Args:
        scene: the robot that holds it.
        log: the flight.
        robot: that flew.
        times: (K,) s, of the frames.
    """
    try:
        held = [
            (Grasp.of(robot, event.target), event.time_s, after.time_s if after else np.inf)
            for event, after in pairwise([*events_of(log), None])
            if isinstance(event, Capture)
        ]
    except InputError:
        return []
    return [
        _holding(scene, f"target_{number}", grasp, _first(times, start), _first(times, stop))
        for number, (grasp, start, stop) in enumerate(held)
    ]


def _holding(scene: RobotScene, name: str, grasp: Grasp, start: int, stop: int) -> Move:
    box = even_box(grasp.mass, grasp.inertia, grasp.com, grasp.body, COLOUR)
    shape = scene.add_shape(name, box)
    shape.visible = False

    def hold(k: int) -> None:
        if k in (start, stop):
            shape.visible = k == start

    return hold


def _first(times: Array, event: float) -> int:
    """Return the first frame at which an event has happened; an early one is in none but that."""
    return int(np.searchsorted(times, event - 1e-9))
