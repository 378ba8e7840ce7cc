"""Centre of mass and angular momentum of the whole robot, for every tick of a flight at once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import reduce
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .base_axes import base_axes, cross, to_base, to_inertial
from .robot import Robot

Array = NDArray[np.float64]

_BATCH = 8192
"""Rows at a time, so that all vectors of a batch stay in the processor's cache."""


class Motion(NamedTuple):
    """Attitude of the base and motion of a robot's bodies, tick by tick."""

    quaternion: Array
    """(N, 4) ``[w, x, y, z]`` of the base, unit."""
    omega_base: Array
    """(N, 3) rad/s, base frame."""
    joint_positions: Array
    """(N, n) rad."""
    joint_velocities: Array
    """(N, n) rad/s."""


class RobotMomentum(NamedTuple):
    """What a robot's bodies have together, tick by tick."""

    centre_of_mass: Array
    """(N, 3) m, of all bodies from the base's CoM, inertial axes."""
    angular: Array
    """(N, 3) N m s, angular momentum about the common centre of mass, inertial axes."""
    base: Array
    """(N, 3) N m s, the share of it that the base has; the arm has the rest."""


class _Body(NamedTuple):
    """A body of the chain, seen from the base's CoM; vectors (3, N) on inertial axes."""

    mass: float
    com: Array
    """m."""
    velocity: Array
    """m/s, of its centre of mass."""
    spin: Array
    """N m s, angular momentum about its own centre of mass."""


def robot_momentum(robot: Robot, motion: Motion) -> RobotMomentum:
    """Sum up ``I_i w_i + m_i (r_i - r) x (v_i - v)`` over all bodies.

    ``r`` and ``v`` are their common CoM's, so the velocity of the base does not matter. Wheels
    count as locked to the base; what their spin adds is not the robot's.

    Raises:
        ValueError: an array has the wrong shape.
    """
    rows, n = len(motion.quaternion), robot.n
    wanted = ((rows, 4), (rows, 3), (rows, n), (rows, n))
    for name, array, shape in zip(motion._fields, motion, wanted, strict=True):
        if array.shape != shape:
            raise ValueError(f"{name}: shape {shape} was expected, got {array.shape}")
    found = RobotMomentum(*(np.empty((rows, 3)) for _ in RobotMomentum._fields))
    mass = float(np.sum(robot.mass))
    for start in range(0, rows, _BATCH):
        part = slice(start, start + _BATCH)
        bodies = list(_bodies(robot, Motion(*(array[part].T for array in motion))))
        centre = _sum(body.mass * body.com for body in bodies) / mass
        velocity = _sum(body.mass * body.velocity for body in bodies) / mass
        shares = [
            body.spin + body.mass * cross(body.com - centre, body.velocity - velocity)
            for body in bodies
        ]
        found.centre_of_mass[part], found.base[part] = centre.T, shares[0].T
        found.angular[part] = _sum(shares).T
    return found


def _sum(vectors: Iterable[Array]) -> Array:
    return reduce(np.add, vectors)


def _bodies(robot: Robot, motion: Motion) -> Iterator[_Body]:
    """Walk the chain (modified Denavit-Hartenberg) from the base outwards; arrays are (., N)."""
    model, theta, rate = robot.model, motion.joint_positions, motion.joint_velocities
    x, y, z = base_axes(motion.quaternion)
    omega = to_inertial(np.array((x, y, z)), motion.omega_base)
    joint, velocity = np.zeros_like(x), np.zeros_like(x)
    yield _body(robot, 0, (x, y, z), joint, velocity, omega)
    for i in range(robot.n):
        ca, sa, ct, st = model.cos_alpha[i], model.sin_alpha[i], np.cos(theta[i]), np.sin(theta[i])
        y, z, first = ca * y + sa * z, ca * z - sa * y, model.a[i] * x
        link = first + model.d[i] * z
        velocity = velocity + cross(omega, link)
        joint = joint + link
        x, y = ct * x + st * y, ct * y - st * x
        omega = omega + rate[i] * z
        yield _body(robot, i + 1, (x, y, z), joint, velocity, omega)


def _body(
    robot: Robot, i: int, axes: tuple[Array, Array, Array], joint: Array, velocity: Array,
    omega: Array,
) -> _Body:  # fmt: skip
    """Return body i, whose frame sits at ``joint`` and moves with ``velocity``."""
    turn = np.array(axes)
    arm = to_inertial(turn, np.broadcast_to(robot.com[i][:, np.newaxis], joint.shape))
    spin = to_inertial(turn, robot.inertia[i] @ to_base(turn, omega))
    return _Body(float(robot.mass[i]), joint + arm, velocity + cross(omega, arm), spin)
