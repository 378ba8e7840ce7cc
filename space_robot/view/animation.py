"""Animated scene of flights, recorded as a page of viser: robots, tool paths, goals, targets."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

from ..analysis.errors import waypoint_ticks
from ..analysis.tool_path import Poses, wanted_poses
from .actuators import ActuatorFrames, DrawnActuators, described_actuators
from .earth import Earth
from .extent import extent
from .frames import Frames, Move
from .orbit import OrbitArrows, OrbitFrames
from .scene import RobotScene, SceneStyle, local_server, rgb
from .stage import Horizon, Stage, clearest_side, set_stage
from .targets import targets

if TYPE_CHECKING:
    from viser import LineSegmentsHandle, SceneApi, ViserServer

Array = NDArray[np.float64]

POSES = 12
"""Number of poses of a flight that the initial camera must contain."""
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
        self.points = extent(robot, self.frames.base_position[rows], *self.poses)
        """(K, 3) m, what the camera must see of the robot."""
        self.place = np.zeros(3)
        """(3,) m, of its frame in the scene."""
        self.orbit = OrbitFrames.of(log, times)
        self.arrows: OrbitArrows | None = None

    def add_arrows(self) -> None:
        """Let it have arrows, if it is in orbit."""
        if self.orbit:
            self.arrows = OrbitArrows(self.flight.robot, self.frames, self.orbit, self.points)

    def draw(self, scene: SceneApi, look: SceneStyle, dark: bool) -> list[Move]:
        """Draw the robot and what belongs to it; return what moves them."""
        flight, frames = self.flight, self.frames
        log, root = flight.log, f"/{flight.name.replace('/', '_')}"
        scene.add_frame(root, show_axes=False, position=self.place)
        size = float(np.ptp(self.points, axis=0).max())
        robot = RobotScene(scene, root, flight.robot, look)
        moves = [_robot(robot, frames)]
        moves += trails(scene, root, frames, rgb(flight.colour), 0.0035 * size)
        if self._wanted is not None:
            _goals(scene, root, log, self._wanted, 0.04 * size)
        flown = described_actuators(log)
        if flown.wheel_count or flown.thruster_count:
            drawn = DrawnActuators(scene, robot, flight.robot, flown, dark)
            moves.append(_actuators(drawn, ActuatorFrames.of(log, flown, self._times)))
        moves += targets(scene, root, robot, log, flight.robot, self._times)
        if self.arrows:
            moves.append(self.arrows.add(scene, root, dark))
        return moves


def _draw(
    server: ViserServer, flights: Sequence[_SampledFlight], side_by_side: bool, dark: bool
) -> list[Move]:
    """Draw flights in an empty scene; return what moves everything to a frame."""
    in_orbit = [flight for flight in flights if flight.orbit]
    orbit = in_orbit[0].orbit if in_orbit else None
    horizon = Horizon.of(orbit) if orbit else None
    if side_by_side:
        _place(flights, horizon.axes[:, 0] if horizon else np.array([1.0, 0.0, 0.0]))
    for flight in in_orbit if side_by_side else in_orbit[:1]:
        flight.add_arrows()
    points = [flight.place + flight.points for flight in flights]
    points += [flight.place + flight.arrows.tips for flight in flights if flight.arrows]
    side = clearest_side([(flight.flight.robot, *flight.poses) for flight in flights], horizon)
    stage = set_stage(server, np.concatenate(points), dark, horizon, side)
    moves = [_earth(server.scene, stage, orbit, dark)] if orbit else []
    for index, flight in enumerate(flights):
        look = SceneStyle()
        if index and not side_by_side:
            growth = 0.004 * float(np.ptp(flight.points, axis=0).max()) * index
            look = SceneStyle(flight.flight.colour, GHOST, growth)
        moves += flight.draw(server.scene, look, dark)
    return moves


def _place(flights: Sequence[_SampledFlight], across: Array) -> None:
    """Give robots places side by side along a unit vector; the first one's is zero."""
    for before, flight in pairwise(flights):
        first, along = before.points @ across, flight.points @ across
        end = float(before.place @ across + first.max())
        width = max(float(np.ptp(along)), float(np.ptp(first)))
        flight.place = (end + GAP * width - float(along.min())) * across


def _earth(scene: SceneApi, stage: Stage, orbit: OrbitFrames, dark: bool) -> Move:
    """Draw the Earth; return what moves it, and dims the Sun's light in its shadow."""
    earth = Earth(scene, orbit, stage.middle, stage.earth_distance, dark)

    def move(k: int) -> None:
        earth.move(orbit.position[k])
        stage.shade(bool(orbit.is_dark[k]))

    return move


def _robot(robot: RobotScene, frames: Frames) -> Move:
    return lambda k: robot.move(
        frames.base_position[k], frames.base_quaternion[k], frames.joints, k
    )


def _actuators(drawn: DrawnActuators, motion: ActuatorFrames) -> Move:
    return lambda k: drawn.move(motion.angles[k], motion.is_saturated[k], motion.thrusts[k])


def trails(
    scene: SceneApi, root: str, frames: Frames, colour: tuple[int, int, int], width: float
) -> list[Move]:
    """Draw the paths of a robot's tools, and, thinner, the desired path of the first tool.

    Args:
        scene: of a server.
        root: name of the robot in the scene.
        frames: of its flight.
        colour: of the flown paths.
        width: of the flown paths, m.
    """
    edges = np.unique(np.linspace(0, len(frames.time) - 1, PIECES + 1).round().astype(int))
    trails: list[Move] = []
    for tool, places in frames.tools.items():
        pieces = {
            int(stop): _line(
                scene,
                f"{root}/trail_{tool.replace('/', '_')}/{start}",
                places[start : stop + 1],
                colour,
                width,
                False,
            )
            for start, stop in pairwise(edges)
        }
        trails.append(_appearing(pieces))
    if frames.desired is not None:
        _line(scene, f"{root}/desired", frames.desired, DESIRED, 0.3 * width, True)
    return trails


def _line(
    scene: SceneApi,
    path: str,
    places: Array,
    colour: tuple[int, int, int],
    width: float,
    visible: bool,
) -> LineSegmentsHandle:
    points = np.stack([places[:-1], places[1:]], axis=1)
    return scene.add_line_segments(path, points, colour, thickness=width, visible=visible)


def _appearing(pieces: dict[int, LineSegmentsHandle]) -> Move:
    def appear(k: int) -> None:
        if k in pieces:
            pieces[k].visible = True

    return appear


def _goals(scene: SceneApi, root: str, log: FlightLog, wanted: Poses, size: float) -> None:
    """Draw axes of a size, m, at the first tool's wanted poses where the mission comes to rest."""
    rows, (orientations, positions) = waypoint_ticks(log)[:MOST_GOALS], wanted
    for number, row in enumerate(rows):
        turn = Rotation.from_matrix(orientations[row]).as_quat(scalar_first=True)
        scene.add_frame(
            f"{root}/goal_{number}",
            axes_length=size,
            axes_radius=0.04 * size,
            wxyz=turn,
            position=positions[row],
        )
