"""Animated scene of flights, recorded as a page of viser."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

from ..analysis.tool_path import wanted_poses
from .actuators import actuators
from .base_surface import clearest_side
from .frames import Frames
from .goals import goals
from .horizon import Horizon
from .local_server import local_server
from .orbit_frames import OrbitFrames
from .orbit_scene import ArrowFrames, earth_frames
from .scene import RobotScene, SceneStyle, rgb
from .stage import extent, set_stage
from .targets import targets
from .trails import Move, trails

if TYPE_CHECKING:
    from viser import ViserServer

Array = NDArray[np.float64]

POSES = 12
"""Number of poses of a flight that the initial camera must contain."""
GAP = 0.15
"""Gap between robots side by side, relative to their width."""
GHOST = 0.4
"""Opacity of robots that overlap another one."""


class FilmedFlight(NamedTuple):
    """A flight to be shown."""

    name: str
    log: FlightLog
    robot: Robot
    law: str
    colour: str
    """Colour of the flight, such as ``#E69F00``."""


def film(
    flights: Sequence[FilmedFlight],
    times: Array,
    side_by_side: bool,
    dark: bool,
    advance: Callable[[int], Callable[[], None]],
) -> str:
    """Return the page of an animated scene of flights.

    Args:
        flights: to be shown.
        times: (K,) of the frames, s.
        side_by_side: whether the robots are side by side instead of overlapping.
        dark: whether the page is light on dark.
        advance: called with the number of frames, then after each frame.

    Raises:
        InputError: viser is not installed, or a flight has no state.
    """
    with local_server() as server:
        moves = add_flights(server, flights, times, side_by_side, dark)
        recorder, done = server.get_scene_serializer(), advance(len(times))
        for k, time in enumerate(times):
            if k:
                recorder.insert_sleep(float(time - times[k - 1]))
            for move in moves:
                move(k)
            done()
        return str(recorder.as_html(dark_mode=dark))


def add_flights(
    server: ViserServer,
    flights: Sequence[FilmedFlight],
    times: Array,
    side_by_side: bool,
    dark: bool,
) -> list[Move]:
    """Add robots, trails and targets to a server's empty scene.

    Args:
        server: whose scene it is.
        flights: to be shown.
        times: (K,) of the frames, s.
        side_by_side: whether the robots are side by side.
        dark: whether the page is light on dark.

    Returns:
        Functions that move everything to a frame.

    Raises:
        InputError: a flight has no state.
    """
    wanted = [wanted_poses(flight.log) for flight in flights]
    frames = [
        Frames.of(flight.log, flight.robot, times, poses and poses[1])
        for flight, poses in zip(flights, wanted, strict=True)
    ]
    seen = [_seen(flight.robot, of) for flight, of in zip(flights, frames, strict=True)]
    orbits = [OrbitFrames.of(flight.log, times) for flight in flights]
    orbit = next(filter(None, orbits), None)
    horizon = Horizon.of(orbit) if orbit else None
    across = horizon.axes[:, 0] if horizon else np.array([1.0, 0.0, 0.0])
    places = _places(seen, across) if side_by_side else [np.zeros(3)] * len(flights)
    scene = server.scene
    points = np.concatenate([s + p for s, p in zip(seen, places, strict=True)])
    arrows = [
        ArrowFrames(flight.robot, of, own, points, dark)
        if own and (side_by_side or own is orbit)
        else None
        for flight, of, own, points in zip(flights, frames, orbits, seen, strict=True)
    ]
    tips = [a.tips + place for a, place in zip(arrows, places, strict=True) if a]
    drawn = [
        (flight.robot, of.base_quaternion[rows], of.joint_positions[rows])
        for flight, of, rows in zip(flights, frames, map(_rows, frames), strict=True)
    ]
    side = clearest_side(drawn, horizon)
    stage = set_stage(server, np.concatenate([points, *tips]), dark, horizon, side)
    moves = [earth_frames(scene, stage, orbit, dark)] if orbit else []
    for index, (flight, of, place) in enumerate(zip(flights, frames, places, strict=True)):
        root = f"/{flight.name.replace('/', '_')}"
        scene.add_frame(root, show_axes=False, position=place)
        over = index > 0 and not side_by_side
        size = float(np.ptp(seen[index], axis=0).max())
        look = SceneStyle(flight.colour, GHOST, 0.004 * size * index) if over else SceneStyle()
        robot = RobotScene(scene, root, flight.robot, look)
        moves.append(_moving(robot, of))
        moves += trails(scene, root, of, rgb(flight.colour), 0.0035 * size)
        if (poses := wanted[index]) is not None:
            goals(scene, root, flight.log, poses, 0.04 * size)
        moves += actuators(scene, robot, flight.log, flight.robot, times, dark)
        moves += targets(scene, root, robot, flight.log, flight.robot, times)
        if own := arrows[index]:
            moves.append(own.add(scene, root))
    return moves


def _moving(robot: RobotScene, frames: Frames) -> Move:
    return lambda k: robot.move(*frames.move_to(k))


def _rows(frames: Frames) -> NDArray[np.intp]:
    return np.linspace(0, len(frames.time) - 1, POSES).round().astype(int)


def _seen(robot: Robot, frames: Frames) -> Array:
    rows = _rows(frames)
    return extent(
        robot,
        frames.base_position[rows],
        frames.base_quaternion[rows],
        frames.joint_positions[rows],
    )


def _places(seen: Sequence[Array], across: Array) -> list[Array]:
    """Return offsets of robots side by side along a unit vector, m; the first one's is zero."""
    places: list[Array] = [np.zeros(3)]
    extents = [points @ across for points in seen]
    end = float(extents[0].max())
    for before, along in pairwise(extents):
        width = max(float(np.ptp(along)), float(np.ptp(before)))
        x = end + GAP * width - float(along.min())
        places.append(x * across)
        end = x + float(along.max())
    return places
