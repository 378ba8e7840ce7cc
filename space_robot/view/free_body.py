"""Free motion of a target before its capture and after its release."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.placements import base_axes, body_frames
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.simulated_time import tick_from
from space_robot_sim.environment.events import Capture
from space_robot_sim.environment.impact import Grasp

Array = NDArray[np.float64]

ACCURACY = 1e-9
"""Relative tolerance of the attitude's integration."""


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
