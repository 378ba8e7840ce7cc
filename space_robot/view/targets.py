"""Targets in a scene: in free motion before their capture, held, and released again."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.placements import base_axes, body_frames
from space_robot_model.robot.shapes import even_box
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.simulated_time import tick_from
from space_robot_sim.environment.events import Capture, Event, Release
from space_robot_sim.environment.impact import Grasp
from space_robot_sim.environment.neighbouring_orbit import free_fall

from ..analysis.described import captures_of, events_of, plant_settings
from ..analysis.momentum import happens_in
from .frames import Move
from .scene import RobotScene, SceneStyle, add_shape, set_pose
from .shapes import TARGET_COLOUR

if TYPE_CHECKING:
    from viser import SceneApi

Array = NDArray[np.float64]

ACCURACY = 1e-9
"""Relative tolerance of the attitude's integration."""


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
        """Return the poses at some times.

        Args:
            times: (K,) relative to the time of the state, s; monotonic, may be negative.

        Returns:
            (K, 3) centre of mass, m, inertial frame; (K, 4) attitude ``[w, x, y, z]``.
        """
        positions = self.position + times[:, np.newaxis] * self.velocity
        return positions, self._attitudes(times)

    def _attitudes(self, times: Array) -> Array:
        """Integrate Euler's equations without torque."""
        start = Rotation.from_matrix(self.rotation)
        momentum = self.rotation @ self.inertia @ self.rotation.T @ self.angular_velocity
        inverse = np.linalg.inv(self.inertia)

        def rate(_: float, quaternion: Array) -> Array:
            axes = Rotation.from_quat(quaternion).as_matrix()
            x, y, z, w = quaternion
            turn = inverse @ (axes.T @ momentum)  # in body axes
            on_left = np.array([[w, -z, y], [z, w, -x], [-y, x, w], [-x, -y, -z]])
            return np.asarray(0.5 * on_left @ turn)

        farthest = float(times[np.argmax(np.abs(times))]) if len(times) else 0.0
        if farthest == 0.0 or not self.angular_velocity.any():
            quaternions = np.tile(start.as_quat(), (len(times), 1))
        else:
            solved = solve_ivp(
                rate,
                (0.0, farthest),
                start.as_quat(),
                dense_output=True,
                rtol=ACCURACY,
                atol=ACCURACY,
            )
            assert solved.sol is not None  # dense output
            quaternions = solved.sol(times).T
        return unit_rows(quaternions)[:, [3, 0, 1, 2]]


def before_capture(capture: Capture, log: FlightLog, robot: Robot) -> FreeBody | None:
    """Return the state of a target just before its capture, with the axes of the grasping body.

    Its position is the tool's at the tick of the capture. Its velocities are those of the event;
    relative ones are added to the tool's velocity over the previous tick.

    Args:
        capture: the event.
        log: the flight.
        robot: that flew.

    Returns:
        None if ``log`` does not have both ticks.
    """
    grasp = Grasp.of(robot, capture.target)
    row = tick_from(capture.time_s, log.timebase.period) - log.first_tick
    if not 1 <= row < log.ticks:
        return None
    part = log.rows(int(row) - 1, int(row) + 1)
    positions, rotations = held_poses(grasp, part, robot)
    if not np.isfinite(positions).all() or not np.isfinite(rotations).all():
        return None
    motion = capture.target.motion
    velocity, angular_velocity = np.array(motion.velocity), np.array(motion.angular_velocity)
    if motion.relative_to == "tool":
        period, axes = log.timebase.period, rotations[1] @ grasp.tool_axes
        turned = Rotation.from_matrix(rotations[1] @ rotations[0].T).as_rotvec()
        velocity = axes @ velocity + (positions[1] - positions[0]) / period
        angular_velocity = axes @ angular_velocity + turned / period
    return FreeBody(positions[1], rotations[1], velocity, angular_velocity, grasp.inertia)


def after_release(
    grasp: Grasp, speed: float, tick: int, log: FlightLog, robot: Robot
) -> FreeBody | None:
    """Return the state of a target just after its release, with the axes of the grasping body.

    Args:
        grasp: that held it.
        speed: m/s at which a spring pushes it off along z of the tool.
        tick: of the release.
        log: the flight.
        robot: that flew.

    Returns:
        None if ``log`` does not have this tick and the next one.
    """
    row = tick - log.first_tick
    if not 0 <= row < log.ticks - 1:
        return None
    positions, rotations = held_poses(grasp, log.rows(row, row + 2), robot)
    if not np.isfinite(positions).all() or not np.isfinite(rotations).all():
        return None
    period = log.timebase.period
    push = speed * (rotations[0] @ grasp.tool_axes)[:, 2]
    return FreeBody(
        positions[0],
        rotations[0],
        push + (positions[1] - positions[0]) / period,
        Rotation.from_matrix(rotations[1] @ rotations[0].T).as_rotvec() / period,
        grasp.inertia,
    )


def held_poses(grasp: Grasp, log: FlightLog, robot: Robot) -> tuple[Array, Array]:
    """Return the poses of a grasped target in each row of a log.

    Returns:
        (N, 3) centre of mass, m, inertial frame; (N, 3, 3) rotation matrices of the grasping body.
    """
    axes = base_axes(log.quaternion.T)
    frames = body_frames(robot, axes, log.all_positions.T)
    carrier = next(frame for frame in frames if frame.body == grasp.body)
    positions = log.base_position + (carrier.origin + carrier.on_outer_axes(grasp.com)).T
    return positions, np.stack([carrier.x.T, carrier.y.T, carrier.z.T], axis=2)
