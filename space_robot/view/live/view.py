"""Live view of a flight: robot, tool paths, curves and text."""

from __future__ import annotations

import html
from collections import deque
from collections.abc import Sequence
from dataclasses import replace
from itertools import cycle
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.placements import joint_transforms, tool_pose

from ...flight.graph.monitor import Event
from ..base_surface import clearest_side
from ..palette import palette
from ..scene import RobotScene, rgb
from ..stage import extent, set_stage
from .actuators import LiveActuators
from .orbit import LiveOrbit
from .window import Curves

if TYPE_CHECKING:
    from viser import LineSegmentsHandle, SceneApi, ViserServer

    from space_robot_sim.environment.orbit import OrbitSettings

    from .listener import Listener, Sample

Array = NDArray[np.float64]

ROOT = "/robot"
TRAIL = 0.0035
"""Width of a tool's trail relative to the size of the scene."""
ROOM = 1.3
"""Field of the first camera relative to the robot's first pose, since the robot moves."""
MOST_EVENTS = 8


PIECE = 60
"""Maximum segments of a piece of the trail; only the last piece is sent again with new points."""
MOST_PIECES = 60
BREAK_S = 0.5
"""Largest simulated time between connected points; larger gaps were not received."""


class Trail:
    """Path of a tool as line segments of the scene."""

    def __init__(
        self, scene: SceneApi, name: str, colour: tuple[int, int, int], width: float
    ) -> None:
        """Create an empty trail.

        Args:
            scene: of a server.
            name: of the trail in the scene.
            colour: red, green and blue, 0 to 255.
            width: of the lines, m.
        """
        self._scene, self._name, self._colour, self._width = scene, name, colour, width
        self._pieces: deque[LineSegmentsHandle] = deque()
        self._segments: list[tuple[Array, Array]] = []
        self._last: tuple[float, Array] | None = None
        self._count = 0

    def add(self, time: float, place: Array) -> None:
        """Extend the trail to a position, (3,) m, at a time, s."""
        last, self._last = self._last, (time, place)
        if last is None or not 0.0 < time - last[0] < BREAK_S:
            return
        if np.linalg.norm(place - last[1]) < 0.2 * self._width:  # too short
            self._last = time, last[1]
            return
        if not self._segments or len(self._segments) >= PIECE:
            self._begin()
        self._segments.append((last[1], place))
        self._pieces[-1].points = np.array(self._segments)

    def _begin(self) -> None:
        self._segments = []
        if len(self._pieces) == MOST_PIECES:
            self._pieces.popleft().remove()
        self._count += 1
        self._pieces.append(
            self._scene.add_line_segments(
                f"{self._name}/{self._count}",
                np.zeros((1, 2, 3)),
                self._colour,
                thickness=self._width,
            )
        )

    def clear(self) -> None:
        """Remove it from the scene."""
        while self._pieces:
            self._pieces.pop().remove()
        self._segments, self._last = [], None


class LiveView:
    """Scene and panel of one robot."""

    def __init__(
        self,
        server: ViserServer,
        robot: Robot,
        sample: Sample,
        dark: bool,
        orbit: OrbitSettings | None = None,
        actuators: BaseActuatorSettings | None = None,
        plots: Sequence[str] = (),
    ) -> None:
        """Add the robot to the empty scene.

        Args:
            server: of viser.
            robot: of the flight.
            sample: its pose.
            dark: whether the page is light on dark.
            orbit: of the flight; None: none.
            actuators: of its base; None: none.
            plots: kinds of the curves that are shown first, see `PLOT_KINDS`; empty: all but the
                wheels' speeds.
        """
        self._server, self._robot = server, robot
        colours, ink = palette(dark), "#c9d1d9" if dark else "#333333"
        pose = _unit(sample), sample.angles[np.newaxis]
        points = extent(robot, sample.base_position[np.newaxis], *pose)
        middle = points.mean(axis=0)
        self._orbit: LiveOrbit | None = None
        if orbit and sample.orbit is not None:
            self._orbit = LiveOrbit(orbit, sample.orbit, robot, points, dark)
        horizon = self._orbit.horizon if self._orbit else None
        room, side = middle + ROOM * (points - middle), clearest_side([(robot, *pose)], horizon)
        stage = set_stage(server, room, dark, horizon=horizon, side=side)
        width = TRAIL * float(np.ptp(points, axis=0).max())
        self._root = server.scene.add_frame(ROOT, show_axes=False)
        self._scene = RobotScene(server.scene, ROOT, robot)
        if self._orbit:
            self._orbit.draw(server.scene, stage, ROOT)
        self._actuators = LiveActuators(
            server.scene, self._scene, robot, actuators or BaseActuatorSettings(), dark
        )
        self._tools = [replace(robot, tools=(tool,)) for tool in robot.tools]
        self._trails = [
            Trail(server.scene, f"{ROOT}/trail of {tool.name}", rgb(colour), width)
            for tool, colour in zip(robot.tools, cycle(colours), strict=False)
        ]
        self._words = server.gui.add_html("")
        self._curves = Curves(server.gui, robot, sample.wheels.shape[1], colours, ink, plots)
        self._events: deque[Event] = deque(maxlen=MOST_EVENTS)
        self.show(sample)

    def show(self, sample: Sample) -> None:
        """Move the robot."""
        position, quaternion = sample.base_position, _unit(sample)
        # two rows, because the scene treats a single row as a constant transform
        links = joint_transforms(self._robot, np.tile(sample.angles, (2, 1)))
        with self._server.atomic():
            self._scene.move(position, quaternion[0], links, 0)
            self._actuators.move(sample)
            if self._orbit and sample.orbit is not None:
                self._orbit.move(position, sample.orbit)
            for robot, trail in zip(self._tools, self._trails, strict=True):
                _, place = tool_pose(robot, quaternion, sample.angles[np.newaxis])
                trail.add(sample.time, position + place[0])
        self._curves.add(sample)

    def tell(self, listener: Listener, speed: float, note: str = "") -> None:
        """Update the panel's text and the curves.

        Args:
            listener: with the received data.
            speed: simulated time per wall-clock time.
            note: additional sentence.
        """
        lines = [
            f"<b>{html.escape(listener.law or '...')}</b>, {html.escape(self._robot.name)}",
            f"<b>{listener.time:.2f} s</b> {f'&times;{speed:.2f} real time' if speed else ''}",
        ]
        lines += [
            f"<span style='color:#d55e00'>{html.escape(node)}: {html.escape(mode)}</span>"
            for node, mode in listener.complaints.items()
        ]
        lines += [html.escape(str(event).strip()) for event in self._events]
        lines += [f"<small>{html.escape(text)}</small>" for text in self._actuators.notes]
        lines += [f"<i>{html.escape(note)}</i>"] if note else []
        content = "<br>".join(lines)
        with self._server.atomic():
            self._words.content = f"<div style='font-size:0.9em;padding:0 1em'>{content}</div>"
            self._curves.draw()

    def note(self, events: Sequence[Event]) -> None:
        """Store events to be shown."""
        self._events.extend(events)

    def close(self) -> None:
        """Remove it from the scene."""
        for trail in self._trails:
            trail.clear()
        if self._orbit:
            self._orbit.close()
        self._root.remove()
        self._words.remove()
        self._curves.remove()


def _unit(sample: Sample) -> Array:
    """Return the base's attitude, (1, 4), normalised: measured quaternions are not exactly unit."""
    unit: Array = sample.base_quaternion[np.newaxis] / np.linalg.norm(sample.base_quaternion)
    return unit
