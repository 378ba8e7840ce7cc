"""Targets in a scene: in free motion, held by the robot, and released again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot_model.robot import Robot
from space_robot_model.robot.shapes import even_box
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.simulated_time import tick_from
from space_robot_sim.environment.events import Capture, Event, Release
from space_robot_sim.environment.impact import Grasp
from space_robot_sim.environment.neighbouring_orbit import free_fall

from ..analysis.described import captures_of, events_of, orbit_of
from ..analysis.momentum import happens_in
from .free_body import after_release, before_capture
from .scene import RobotScene, SceneStyle, add_shape, set_pose
from .spacecraft import TARGET_COLOUR
from .trails import Move

if TYPE_CHECKING:
    from viser import SceneApi

Array = NDArray[np.float64]


class Drift(NamedTuple):
    """A target in free motion, at the frames from `start` on."""

    start: int
    positions: Array
    """(K, 3) centre of mass, m, inertial frame."""
    quaternions: Array
    """(K, 4) of the axes in which its box is drawn."""


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
    moves: list[Move] = []
    try:
        for number, (event, after) in enumerate(_captures(log)):
            grasp = Grasp.of(robot, event.target)
            met = _as_met(event, log)
            if met:
                start, stop = (_first(times, e.time_s if e else np.inf) for e in (event, after))
                moves.append(_holding(robot_scene, f"target_{number}", grasp, start, stop))
            for part, drift in _drifts(event, met, after, grasp, log, robot, times):
                moves.append(_drifting(scene, f"{root}/{part}_target_{number}", grasp, drift))
    except InputError:
        return moves
    return moves


def _captures(log: FlightLog) -> list[tuple[Capture, Event | None]]:
    """Return each capture and the event after it."""
    pairs = pairwise([*events_of(log), None])
    return [(event, after) for event, after in pairs if isinstance(event, Capture)]


def _as_met(event: Capture, log: FlightLog) -> Capture | None:
    """Return a capture with the motion that its target has then; None if it misses its target.

    Raises:
        InputError: the robot or its environment are not known.
    """
    if not event.target.is_in_orbit:
        return event
    captures = captures_of(log)
    exchange = next(exchange for exchange in captures.exchanges if exchange.event == event)
    row = int(exchange.tick) - log.first_tick
    if 0 <= row < log.ticks:
        happens_in(captures, exchange, log.rows(row, row + 1))
    if exchange.tick in captures.misses or exchange.target_state is None:
        return None
    motion = {"motion": exchange.target_state.motion}
    return replace(event, target=event.target.model_copy(update=motion))


def _drifts(
    event: Capture,
    met: Capture | None,
    after: Event | None,
    grasp: Grasp,
    log: FlightLog,
    robot: Robot,
    times: Array,
) -> Iterator[tuple[str, Drift]]:
    """Yield the free motions of a target: before its capture or past the robot, and after."""
    period = log.timebase.period
    start = _first(times, event.time_s)
    moment = tick_from(event.time_s, period) * period
    body = before_capture(met, log, robot) if met else None
    if met is None:  # it flies past
        positions, axes = free_fall(event.target, orbit_of(log), times)
        own = Rotation.from_matrix(grasp.tool_axes @ event.target.rotation)
        turns = Rotation.from_quat(axes, scalar_first=True) * own.inv()
        yield "free", Drift(0, positions, turns.as_quat(scalar_first=True))
    elif body is not None and start > 0 and event.target.is_in_orbit:
        positions, axes = free_fall(event.target, orbit_of(log), np.append(times[:start], moment))
        turns = Rotation.from_quat(axes, scalar_first=True)
        # the box is drawn in the axes of the body that will hold it
        fixed = turns[-1].inv() * Rotation.from_matrix(body.rotation)
        drawn = (turns[:-1] * fixed).as_quat(scalar_first=True)
        yield "free", Drift(0, positions[:-1], drawn)
    elif body is not None and start > 0:
        yield "free", Drift(0, *body.poses(times[:start] - moment))
    if met and isinstance(after, Release) and (stop := _first(times, after.time_s)) < len(times):
        tick = tick_from(after.time_s, period)
        released = after_release(grasp, after.speed, int(tick), log, robot)
        if released is not None:
            yield "released", Drift(stop, *released.poses(times[stop:] - tick * period))


def _holding(scene: RobotScene, name: str, grasp: Grasp, start: int, stop: int) -> Move:
    box = even_box(grasp.mass, grasp.inertia, grasp.com, grasp.body, TARGET_COLOUR)
    shape = scene.add_shape(name, box)
    shape.visible = False

    def hold(k: int) -> None:
        if k in (start, stop):
            shape.visible = k == start

    return hold


def _drifting(scene: SceneApi, path: str, grasp: Grasp, drift: Drift) -> Move:
    """Draw a target in free motion."""
    frame = scene.add_frame(path, show_axes=False, visible=drift.start == 0)
    box = even_box(grasp.mass, grasp.inertia, np.zeros(3), 0, TARGET_COLOUR)
    add_shape(scene, f"{path}/box", box, SceneStyle())
    end = drift.start + len(drift.positions)

    def move(k: int) -> None:
        if drift.start <= k < end:
            set_pose(frame, "position", drift.positions[k - drift.start])
            set_pose(frame, "wxyz", drift.quaternions[k - drift.start])
        if k in (drift.start, end):
            frame.visible = k == drift.start

    return move


def _first(times: Array, event: float) -> int:
    """Return the first frame at or after an event."""
    return int(np.searchsorted(times, event - 1e-9))
