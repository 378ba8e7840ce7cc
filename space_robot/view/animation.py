"""Animated scene of flights, recorded as a page of viser: robots, tool paths, goals, targets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

from ..analysis.errors import waypoint_ticks
from ..analysis.tool_path import Poses, wanted_poses
from .actuators import add_actuators
from .frames import Frames, Move
from .orbit import OrbitArrows, OrbitFrames, add_earth
from .scene import PLAIN, RGB, RobotScene, SceneStyle, local_server, rgb
from .shapes import extent
from .stage import clearest_side, set_stage
from .targets import add_targets

if TYPE_CHECKING:
    from viser import LineSegmentsHandle, SceneApi, ViserServer

POSES = 12
"""Number of poses of a flight from which the side of the initial camera is chosen."""
GAP = 0.15
"""Gap between robots side by side, relative to their width."""
GHOST = 0.4
"""Opacity of robots that overlap another one."""
PIECES = 60
"""Pieces of a trail, which appear one after the other."""
DESIRED = (128, 128, 128)
"""Colour of the desired path."""
MOST_GOALS = 50


class ShownFlight(NamedTuple):
    """A flight to be shown."""

    name: str
    log: FlightLog
    robot: Robot
    colour: str
    """Colour of the flight, such as ``#E69F00``."""


def animate(
    flights: Sequence[ShownFlight],
    times: Array,
    side_by_side: bool,
    dark: bool,
    advance: Callable[[int], Callable[[], None]],
) -> str:
    """Return the page of an animated scene of flights with frames at ``times`` (K,), s.

    The robots are side by side or overlap. ``advance`` is called with the number of frames; what
    it returns after each frame.

    Raises:
        InputError: viser is not installed, or a flight has no state.
    """
    with local_server() as server:
        sampled = [_SampledFlight(flight, times) for flight in flights]
        moves = _draw(server, sampled, side_by_side, dark)
        recorder, done = server.get_scene_serializer(), advance(len(times))
        for k, time in enumerate(times):
            if k:
                recorder.insert_sleep(float(time - times[k - 1]))
            for move in moves:
                move(k)
            done()
        return str(recorder.as_html(dark_mode=dark))


class _SampledFlight:
    """A flight at the times of the frames."""

    def __init__(self, flight: ShownFlight, times: Array) -> None:
        log, robot = flight.log, flight.robot
        self.flight, self._times, self._wanted = flight, times, wanted_poses(log)
        self.frames = Frames.of(log, robot, times, self._wanted and self._wanted[1])
        rows = np.linspace(0, len(times) - 1, POSES).round().astype(int)
        self.poses = self.frames.base_quaternion[rows], self.frames.joint_positions[rows]
        frames = self.frames
        self.points = extent(
            robot, frames.base_position, frames.base_quaternion, frames.joint_positions
        )
        """(K, 3) m, what the initial camera sees of the robot: all its boxes in all frames."""
        self.size = float(np.ptp(self.points, axis=0).max())
        self.place = np.zeros(3)
        """(3,) m, of its frame in the scene."""
        self.orbit = OrbitFrames.of(log, times)
        self.arrows: OrbitArrows | None = None

    def draw(self, scene: SceneApi, style: SceneStyle, dark: bool) -> list[Move]:
        """Draw the robot and what belongs to it; return what moves them."""
        flight, frames, times = self.flight, self.frames, self._times
        log, root = flight.log, f"/{flight.name.replace('/', '_')}"
        scene.add_frame(root, show_axes=False, position=self.place)
        robot = RobotScene(scene, root, flight.robot, style)
        position, quaternion = frames.base_position, frames.base_quaternion
        moves: list[Move] = [lambda k: robot.move(position[k], quaternion[k], frames.joints, k)]
        moves += trails(scene, root, frames, rgb(flight.colour), 0.0035 * self.size)
        if self._wanted is not None:
            _add_goals(scene, root, log, self._wanted, 0.04 * self.size)
        moves += add_actuators(scene, robot.base.name, flight.robot, log, times, dark)
        moves += add_targets(scene, root, robot, log, flight.robot, times)
        if self.arrows:
            moves.append(self.arrows.add(scene, root, dark))
        return moves


def _draw(
    server: ViserServer, flights: Sequence[_SampledFlight], side_by_side: bool, dark: bool
) -> list[Move]:
    """Draw flights in an empty scene; return what moves everything to a frame."""
    in_orbit = [flight for flight in flights if flight.orbit]
    orbit = in_orbit[0].orbit if in_orbit else None
    if side_by_side:
        _place(flights, orbit.axes[:, 0] if orbit else np.array([1.0, 0.0, 0.0]))
    for flight in in_orbit if side_by_side else in_orbit[:1]:
        assert flight.orbit
        robot = flight.flight.robot
        flight.arrows = OrbitArrows(robot, flight.frames, flight.orbit, flight.points)
    points = [flight.place + flight.points for flight in flights]
    points += [flight.place + flight.arrows.tips for flight in flights if flight.arrows]
    side = clearest_side([(flight.flight.robot, *flight.poses) for flight in flights], orbit)
    stage = set_stage(server, np.concatenate(points), dark, orbit, side)
    moves: list[Move] = []
    if orbit:
        is_dark = orbit.is_dark
        moves = [
            add_earth(server.scene, orbit, stage.middle, stage.earth_distance, dark),
            lambda k: stage.shade(bool(is_dark[k])),
        ]
    for index, flight in enumerate(flights):
        style = PLAIN
        if index and not side_by_side:
            style = SceneStyle(flight.flight.colour, GHOST, 0.004 * flight.size * index)
        moves += flight.draw(server.scene, style, dark)
    return moves


def _place(flights: Sequence[_SampledFlight], across: Array) -> None:
    """Give robots places side by side along a unit vector; the first one's is zero."""
    for before, flight in pairwise(flights):
        first, along = before.points @ across, flight.points @ across
        end = float(before.place @ across + first.max())
        width = max(float(np.ptp(along)), float(np.ptp(first)))
        flight.place = (end + GAP * width - float(along.min())) * across


def trails(scene: SceneApi, root: str, frames: Frames, colour: RGB, width: float) -> list[Move]:
    """Draw the paths of a robot's tools, and, thinner, the desired path of the first tool.

    Their ``width`` is in m; ``root`` is the name of the robot in the scene. Return what lets the
    flown ones appear piece by piece.
    """
    edges = np.unique(np.linspace(0, len(frames.time) - 1, PIECES + 1).round().astype(int))
    moves: list[Move] = []
    for tool, places in frames.tools.items():
        pieces = {
            int(stop): _add_line(
                scene,
                f"{root}/trail_{tool.replace('/', '_')}/{start}",
                places[start : stop + 1],
                colour,
                width,
                False,
            )
            for start, stop in pairwise(edges)
        }
        moves.append(_appearing(pieces))
    if frames.desired is not None:
        _add_line(scene, f"{root}/desired", frames.desired, DESIRED, 0.3 * width, True)
    return moves


def _add_line(
    scene: SceneApi, path: str, places: Array, colour: RGB, width: float, visible: bool
) -> LineSegmentsHandle:
    points = np.stack([places[:-1], places[1:]], axis=1)
    return scene.add_line_segments(path, points, colour, thickness=width, visible=visible)


def _appearing(pieces: dict[int, LineSegmentsHandle]) -> Move:
    def appear(k: int) -> None:
        if k in pieces:
            pieces[k].visible = True

    return appear


def _add_goals(scene: SceneApi, root: str, log: FlightLog, wanted: Poses, size: float) -> None:
    """Draw axes of a size, m, at the first tool's wanted poses where the mission comes to rest."""
    orientations, positions = wanted
    for number, row in enumerate(waypoint_ticks(log)[:MOST_GOALS]):
        scene.add_frame(
            f"{root}/goal_{number}",
            axes_length=size,
            axes_radius=0.04 * size,
            wxyz=Rotation.from_matrix(orientations[row]).as_quat(scalar_first=True),
            position=positions[row],
        )
