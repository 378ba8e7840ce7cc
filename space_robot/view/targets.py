"""Targets in a scene: in free motion before their capture, held, and released again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from space_robot_model.elementary.matrices import Array, unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.placements import base_axes, body_frames
from space_robot_model.robot.shapes import even_box
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.simulated_time import tick_from
from space_robot_sim.environment.events import Capture, Event, Release
from space_robot_sim.environment.impact import Grasp
from space_robot_sim.environment.neighbouring_orbit import free_fall

from ..analysis.described import flown_captures, flown_events, plant_settings
from ..analysis.momentum import happens_in
from .frames import Move
from .scene import RobotScene, add_shape, set_pose
from .shapes import TARGET_COLOUR

if TYPE_CHECKING:
    from viser import SceneApi

ACCURACY = 1e-9
"""Relative tolerance of the attitude's integration."""


class Drift(NamedTuple):
    """A target in free motion, at the frames from `start` on."""

    start: int
    positions: Array
    """(K, 3) centre of mass, m, inertial frame."""
    quaternions: Array
    """(K, 4) of the axes in which its box is drawn."""


def add_targets(
    scene: SceneApi, root: str, robot_scene: RobotScene, log: FlightLog, robot: Robot, times: Array
) -> list[Move]:
    """Draw each target of a flight as a box of uniform density; return what moves them.

    ``root`` is the name of the robot in the scene, ``times`` (K,), s, are those of the frames.
    """
    moves: list[Move] = []
    try:
        pairs = pairwise([*flown_events(log), None])
        captures = [(event, after) for event, after in pairs if isinstance(event, Capture)]
        for number, (event, after) in enumerate(captures):
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


def _as_met(event: Capture, log: FlightLog) -> Capture | None:
    """Return a capture with the motion that its target has then; None if it misses its target.

    Raises:
        InputError: the robot or its environment are not known.
    """
    if not event.target.is_in_orbit:
        return event
    captures = flown_captures(log)
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
        positions, axes = free_fall(event.target, plant_settings(log), times)
        own = Rotation.from_matrix(grasp.tool_axes @ event.target.rotation)
        turns = Rotation.from_quat(axes, scalar_first=True) * own.inv()
        yield "free", Drift(0, positions, turns.as_quat(scalar_first=True))
    elif body is not None and start > 0 and event.target.is_in_orbit:
        orbit = plant_settings(log)
        positions, axes = free_fall(event.target, orbit, np.append(times[:start], moment))
        turns = Rotation.from_quat(axes, scalar_first=True)
        # the box is drawn in the axes of the body that will hold it
        fixed = turns[-1].inv() * Rotation.from_matrix(body.rotation)
        drawn = (turns[:-1] * fixed).as_quat(scalar_first=True)
        yield "free", Drift(0, positions[:-1], drawn)
    elif body is not None and start > 0:
        yield "free", Drift(0, *body.poses(times[:start] - moment))
    if met and isinstance(after, Release) and (stop := _first(times, after.time_s)) < len(times):
        tick = int(tick_from(after.time_s, period))
        hand = _hand(grasp, log, robot, tick - log.first_tick)
        if hand is not None:
            push = after.speed * (hand.rotation @ grasp.tool_axes)[:, 2]  # of a spring
            released = hand._replace(velocity=hand.velocity + push)
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
    frame = scene.add_frame(path, show_axes=False, visible=drift.start == 0)
    box = even_box(grasp.mass, grasp.inertia, np.zeros(3), 0, TARGET_COLOUR)
    add_shape(scene, f"{path}/box", box)
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


class FreeBody(NamedTuple):
    """State of a rigid body in free motion at one time."""

    position: Array
    """(3,) position of the centre of mass, m, inertial frame."""
    rotation: Array
    """(3, 3) rotation matrix from body axes to inertial axes."""
    velocity: Array
    """(3,) velocity, m/s, inertial frame."""
    angular_velocity: Array
    """(3,) angular velocity, rad/s, inertial axes."""
    inertia: Array
    """(3, 3) inertia about the centre of mass, kg m2, body axes."""

    def poses(self, times: Array) -> tuple[Array, Array]:
        """Return centres of mass (K, 3), m, and attitudes (K, 4), by Euler's equations.

        The ``times`` (K,) are relative to that of the state, s; monotonic, may be negative.
        """
        start = Rotation.from_matrix(self.rotation)
        momentum = self.rotation @ self.inertia @ self.rotation.T @ self.angular_velocity
        inverse = np.linalg.inv(self.inertia)

        def rate(_: float, quaternion: Array) -> Array:
            turn = inverse @ Rotation.from_quat(quaternion).inv().apply(momentum)  # body axes
            x, y, z, w = quaternion
            on_left = np.array([[w, -z, y], [z, w, -x], [-y, x, w], [-x, -y, -z]])
            return np.asarray(0.5 * on_left @ turn)

        farthest = float(times[np.argmax(np.abs(times))]) if len(times) else 0.0
        quaternions = np.tile(start.as_quat(), (len(times), 1))
        if farthest and self.angular_velocity.any():
            options: Any = {"dense_output": True, "rtol": ACCURACY, "atol": ACCURACY}
            solved = solve_ivp(rate, (0.0, farthest), start.as_quat(), **options)
            assert solved.sol is not None  # dense output
            quaternions = solved.sol(times).T
        positions = self.position + times[:, np.newaxis] * self.velocity
        return positions, unit_rows(quaternions)[:, [3, 0, 1, 2]]


def before_capture(capture: Capture, log: FlightLog, robot: Robot) -> FreeBody | None:
    """Return the state of a target just before its capture, on the axes of the grasping body.

    Its position is the tool's at the tick of the capture. Its velocities are those of the event;
    relative ones are added to the tool's velocity over the previous tick. None if ``log`` does
    not have both ticks.
    """
    grasp = Grasp.of(robot, capture.target)
    row = tick_from(capture.time_s, log.timebase.period) - log.first_tick
    hand = _hand(grasp, log, robot, int(row), -1)
    if hand is None:
        return None
    motion = capture.target.motion
    velocity, angular_velocity = np.array(motion.velocity), np.array(motion.angular_velocity)
    if motion.relative_to == "tool":
        axes = hand.rotation @ grasp.tool_axes
        velocity = axes @ velocity + hand.velocity
        angular_velocity = axes @ angular_velocity + hand.angular_velocity
    return hand._replace(velocity=velocity, angular_velocity=angular_velocity)


def _hand(
    grasp: Grasp, log: FlightLog, robot: Robot, row: int, neighbour: int = 1
) -> FreeBody | None:
    """Return the state of a held target in a row, its velocity from it to the neighbouring one."""
    first = min(row, row + neighbour)
    if not 0 <= first < log.ticks - 1:
        return None
    positions, rotations = held_poses(grasp, log.rows(first, first + 2), robot)
    if not np.isfinite(positions).all() or not np.isfinite(rotations).all():
        return None
    period = log.timebase.period
    turned = Rotation.from_matrix(rotations[1] @ rotations[0].T).as_rotvec()
    velocity, here = (positions[1] - positions[0]) / period, row - first
    return FreeBody(positions[here], rotations[here], velocity, turned / period, grasp.inertia)


def held_poses(grasp: Grasp, log: FlightLog, robot: Robot) -> tuple[Array, Array]:
    """Return the poses of a grasped target in each row of a log, inertial frame.

    They are its centre of mass (N, 3), m, and the rotation matrices (N, 3, 3) of the body that
    holds it.
    """
    axes = base_axes(log.quaternion.T)
    frames = body_frames(robot, axes, log.all_positions.T)
    carrier = next(frame for frame in frames if frame.body == grasp.body)
    positions = log.base_position + (carrier.origin + carrier.on_outer_axes(grasp.com)).T
    return positions, np.stack([carrier.x.T, carrier.y.T, carrier.z.T], axis=2)
