"""Inertia of a robot's joints with gears: couplings of rotors to the bodies that carry them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from ..elementary.matrices import Array, solve
from .dynamics import mass_matrix
from .placements import BodyFrame, base_axes, body_frames
from .robot import Robot


def geared_joints(robot: Robot) -> list[int]:
    """Return the joints with gears, in the order of their motors."""
    return [joint for joint, gear in enumerate(robot.gears) if gear]


def rotor_rows(robot: Robot, frames: Mapping[int, BodyFrame]) -> tuple[Array, Array]:
    """Return what the motors of G geared joints add to the inertia matrix H of (7).

    Args:
        robot: with N joints.
        frames: by number of the body, at one configuration.

    Returns:
        Rows (G, N+6) ``N_g J z^T J_w`` by ``[v0, w0, thetadot]``, with J_w the Jacobian of the
        angular velocity of the joint's parent, kg m2; and ``N_g^2 J`` (G,), kg m2 or kg. Motor
        angles are seen through the gears.
    """
    joints = geared_joints(robot)
    rows, reflected = np.zeros((len(joints), 6 + robot.joint_count)), np.zeros(len(joints))
    for k, joint in enumerate(joints):
        gear = robot.gears[joint]
        assert gear
        axis = frames[joint + 1].z[:, 0]
        rows[k, 3:6], reflected[k] = axis, gear.reflected_inertia
        body = int(robot.parent[joint])
        while body:
            if not robot.is_prismatic[body - 1]:
                rows[k, 5 + body] = np.sum(axis * frames[body].z[:, 0])
            body = int(robot.parent[body - 1])
        rows[k] *= gear.ratio * gear.rotor_inertia
    return rows, reflected


class FlexibleModel(NamedTuple):
    """Matrices of small motions of a robot with gears, by ``[v0, w0, thetadot, thetadot_m]``."""

    inertia: Array
    """(N+6+G, N+6+G) kg m2, kg m, kg."""
    stiffness: Array
    """(N+6+G, N+6+G) of gears and passive joints, N m/rad or N/m."""
    damping: Array
    """(N+6+G, N+6+G) of gears and passive joints, N m s/rad or N s/m."""

    @property
    def fastest(self) -> float:
        """Largest absolute eigenvalue, rad/s."""
        size = len(self.inertia)
        # first-order form of M xdd + D xd + K x = 0
        system = np.zeros((2 * size, 2 * size))
        system[:size, size:] = np.eye(size)
        system[size:, :size] = -solve(self.inertia, self.stiffness)
        system[size:, size:] = -solve(self.inertia, self.damping)
        return float(np.abs(np.linalg.eigvals(system)).max())


def flexible_model(robot: Robot, joint_positions: Array) -> FlexibleModel:
    """Return the matrices of small motions about a configuration (N,), rad or m, at rest."""
    upright = np.array([1.0, 0.0, 0.0, 0.0])
    base = base_axes(upright[:, np.newaxis])
    walk = body_frames(robot, base, joint_positions[:, np.newaxis])
    rows, reflected = rotor_rows(robot, {frame.body: frame for frame in walk})
    size = 6 + robot.joint_count
    matrices = [np.zeros((size + len(rows), size + len(rows))) for _ in range(3)]
    inertia, stiffness, damping = matrices
    inertia[:size, :size] = mass_matrix(robot, upright, joint_positions)
    inertia[size:, :size], inertia[:size, size:] = rows, rows.T
    inertia[size:, size:] = np.diag(reflected)
    for k, joint in enumerate(geared_joints(robot)):
        gear, places = robot.gears[joint], np.ix_((6 + joint, size + k), (6 + joint, size + k))
        assert gear
        # the torque of a gear, K (theta_m - theta), acts on both sides
        couple = np.array([[1.0, -1.0], [-1.0, 1.0]])
        stiffness[places] += gear.stiffness * couple
        damping[places] += gear.damping * couple
    for k, spring in enumerate(robot.springs, start=6 + robot.n):
        stiffness[k, k], damping[k, k] = spring.stiffness, spring.damping
    return FlexibleModel(inertia, stiffness, damping)


def motor_momentum(
    robot: Robot, quaternion: Array, joint_positions: Array, motor_velocities: Array
) -> Array:
    """Return what the rotors' spin relative to their carriers adds to the angular momentum.

    Args:
        robot: with G geared joints.
        quaternion: (T, 4) of the base, unit.
        joint_positions: (T, N) of all joints, rad or m.
        motor_velocities: (T, G) seen through the gears, rad/s or m/s.

    Returns:
        (T, 3) ``sum J N thetadot_m z``, inertial axes, N m s.
    """
    total, joints = np.zeros((3, len(quaternion))), geared_joints(robot)
    if not motor_velocities.shape[1]:
        return total.T
    axes = base_axes(quaternion.T)
    frames = {f.body: f for f in body_frames(robot, axes, joint_positions.T)}
    for k, joint in enumerate(joints):
        gear = robot.gears[joint]
        assert gear
        spin = gear.rotor_inertia * gear.ratio * motor_velocities[:, k]
        total += spin * frames[joint + 1].z
    return total.T
