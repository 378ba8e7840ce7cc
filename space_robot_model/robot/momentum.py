"""Centre of mass and angular momentum of the robot, for all ticks of a flight at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import reduce
from typing import NamedTuple

import numpy as np

from ..elementary.matrices import Array, product
from .placements import BATCH, BodyFrame, base_axes, body_frames, cross, to_base, to_inertial
from .robot import Robot


class Motion(NamedTuple):
    """Attitude of the base and motion of a robot's bodies, at N ticks."""

    quaternion: Array
    """(N, 4) unit quaternion ``[w, x, y, z]`` of the base."""
    omega_base: Array
    """(N, 3) angular velocity of the base, rad/s, base frame."""
    joint_positions: Array
    """(T, N) positions of all joints, passive ones last; rad, or m for prismatic joints."""
    joint_velocities: Array
    """(T, N) velocities of the joints, rad/s or m/s."""


class RobotMomentum(NamedTuple):
    """Total momentum of a robot's bodies, at each tick."""

    centre_of_mass: Array
    """(N, 3) common centre of mass relative to the base's frame, m, inertial axes."""
    angular: Array
    """(N, 3) angular momentum about the common centre of mass, N m s, inertial axes."""
    base: Array
    """(N, 3) contribution of the base, N m s; the rest is that of the arm."""


class _Body(NamedTuple):
    """A body of the chain, relative to the base's CoM; vectors (3, N) in inertial axes."""

    mass: float
    com: Array
    """Position of its centre of mass, m."""
    velocity: Array
    """Velocity of its centre of mass, m/s."""
    spin: Array
    """Angular momentum about its centre of mass, N m s."""


def robot_momentum(robot: Robot, motion: Motion) -> RobotMomentum:
    """Return the sum of ``I_i w_i + m_i (r_i - r) x (v_i - v)`` over all bodies.

    ``r`` and ``v`` are those of the common CoM, so the velocity of the base is not needed. Wheels
    count as locked to the base; their spin momentum is not included.
    """
    rows = len(motion.quaternion)
    momentum = RobotMomentum(*(np.empty((rows, 3)) for _ in RobotMomentum._fields))
    mass = float(np.sum(robot.mass))
    for start in range(0, rows, BATCH):
        part = slice(start, start + BATCH)
        bodies = list(_bodies(robot, Motion(*(array[part].T for array in motion))))
        centre = _sum(body.mass * body.com for body in bodies) / mass
        velocity = _sum(body.mass * body.velocity for body in bodies) / mass
        shares = [
            body.spin + body.mass * cross(body.com - centre, body.velocity - velocity)
            for body in bodies
        ]
        momentum.centre_of_mass[part], momentum.base[part] = centre.T, shares[0].T
        momentum.angular[part] = _sum(shares).T
    return momentum


def _sum(vectors: Iterable[Array]) -> Array:
    return reduce(np.add, vectors)


def _bodies(robot: Robot, motion: Motion) -> Iterator[_Body]:
    """Yield the bodies from the base outwards; arrays are (., T)."""
    axes = base_axes(motion.quaternion)
    omega = {0: to_inertial(axes, motion.omega_base)}
    frames: dict[int, BodyFrame] = {}
    velocity = {0: np.zeros_like(omega[0])}
    for frame in body_frames(robot, axes, motion.joint_positions):
        body, joint = frame.body, frame.body - 1
        if body:
            parent, rate = int(robot.parent[joint]), motion.joint_velocities[joint]
            # also of a prismatic joint: its link turns with the parent about the parent's origin
            link = frame.origin - frames[parent].origin
            velocity[body] = velocity[parent] + cross(omega[parent], link)
            omega[body] = omega[parent]
            if robot.is_prismatic[joint]:
                velocity[body] = velocity[body] + rate * frame.z
            else:
                omega[body] = omega[body] + rate * frame.z
        frames[body] = frame
        yield _body(robot, frame, velocity[body], omega[body])


def _body(robot: Robot, frame: BodyFrame, velocity: Array, omega: Array) -> _Body:
    turn = np.array((frame.x, frame.y, frame.z))
    arm = frame.on_outer_axes(robot.com[frame.body])
    spin = to_inertial(turn, product(robot.inertia[frame.body], to_base(turn, omega)))
    mass = float(robot.mass[frame.body])
    return _Body(mass, frame.origin + arm, velocity + cross(omega, arm), spin)
