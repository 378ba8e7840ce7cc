"""The model that is linear in second moments of mass, by Jacobians in dense NumPy."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from oracles import attitude_jacobian_inertial, rotation_of, skew
from space_robot_model.dynamics.regressor import (
    MassCoordinates,
    mass_coordinates_into,
    second_moments_into,
)
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot


def frames(robot: Robot, quaternion: Array, theta: Array) -> tuple[Array, Array]:
    """Axes (n+1, 3, 3) of the bodies, and of the joints (n, 3), as inertial ones."""
    axes, joints = [rotation_of(quaternion).as_matrix()], []
    for j in range(robot.n):
        zero = axes[robot.parent[j]] @ robot.rotation[j]
        half = 0.0 if robot.is_prismatic[j] else 0.5 * theta[j]
        axes.append(zero @ rotation_of([np.cos(half), 0.0, 0.0, np.sin(half)]).as_matrix())
        joints.append(zero[:, 2])
    return np.array(axes), np.array(joints)


def vectors(robot: Robot, quaternion: Array, theta: Array) -> Array:
    """The vectors u_k as columns (3, 2n+3); zero where a prismatic joint has none."""
    axes, joints = frames(robot, quaternion, theta)
    columns = list(axes[0].T)
    for j in range(robot.n):
        along = [joints[j] * theta[j], np.zeros(3)]
        columns += along if robot.is_prismatic[j] else list(axes[j + 1].T[:2])
    return np.array(columns).T


class Jacobians(NamedTuple):
    """Jacobians (2n+3, 3, m) of the vectors by rho or by ``[w0, theta]``, and their rates."""

    of_vectors: Array
    rates: Array

    def inertia(self, moments: Array) -> Array:
        """H of second moments D."""
        inertia: Array = np.einsum("kl,kam,lan->mn", moments, self.of_vectors, self.of_vectors)
        return inertia

    def coriolis(self, moments: Array) -> Array:
        """C of second moments D."""
        matrix: Array = np.einsum("kl,kam,lan->mn", moments, self.of_vectors, self.rates)
        return matrix

    def force(self, moments: Array, v: Array, v_rate: Array) -> Array:
        """``Y pi = H vdot + C v``."""
        return self.inertia(moments) @ v_rate + self.coriolis(moments) @ v

    def gradient(self, s: Array, v: Array, v_rate: Array) -> Array:
        """Derivative of ``s^T Y pi`` by the symmetric D."""
        product = (self.of_vectors @ s) @ (self.of_vectors @ v_rate + self.rates @ v).T
        return 0.5 * (product + product.T)


def jacobians(
    robot: Robot, quaternion: Array, theta: Array, rate: Array, in_rho: bool = True
) -> Jacobians:
    """Jacobians of the vectors where the robot has the velocity ``rate`` (m,).

    Its base part is epsdot, or w0 in inertial axes without ``in_rho``.
    """
    m, u = robot.n + 3, vectors(robot, quaternion, theta)
    _, axes = frames(robot, quaternion, theta)
    turn = np.zeros((robot.n + 1, 3, m))  # angular Jacobian of each body, and its rate
    turn_rate, turn[0, :, :3] = np.zeros_like(turn), np.eye(3)
    if in_rho:
        inverse = np.linalg.inv(attitude_jacobian_inertial(quaternion))
        eta_rate = -0.5 * quaternion[1:] @ inverse @ rate[:3]
        jacobian_rate = 0.5 * (eta_rate * np.eye(3) - skew(rate[:3]))
        turn[0, :, :3], turn_rate[0, :, :3] = inverse, -inverse @ jacobian_rate @ inverse
    bodies, slides = [0, 0, 0], np.zeros((2 * robot.n + 3, 3, m))
    slide_rates = np.zeros_like(slides)
    for j in range(robot.n):
        parent, z = robot.parent[j], axes[j]
        z_rate = np.cross(turn[parent] @ rate, z)
        turn[j + 1], turn_rate[j + 1] = turn[parent], turn_rate[parent]
        one, its_rate = (slides, slide_rates) if robot.is_prismatic[j] else (turn, turn_rate)
        row = 3 + 2 * j if robot.is_prismatic[j] else j + 1
        one[row, :, 3 + j], its_rate[row, :, 3 + j] = z, z_rate
        bodies += [j + 1, j + 1]
    of_vectors, rates = np.zeros((2, 2 * robot.n + 3, 3, m))
    for k, i in enumerate(bodies):
        of_vectors[k] = -skew(u[:, k]) @ turn[i] + slides[k]
        u_rate = of_vectors[k] @ rate
        rates[k] = -skew(u_rate) @ turn[i] - skew(u[:, k]) @ turn_rate[i] + slide_rates[k]
    return Jacobians(of_vectors, rates)


def second_moments(robot: Robot, factor: ArrayLike = 1.0) -> Array:
    """D of a robot whose bodies have ``factor`` times their mass, by the code under test."""
    coordinates, out = MassCoordinates.allocate(robot.n), np.zeros((2 * robot.n + 3,) * 2)
    mass_coordinates_into(robot.model, coordinates)
    factors = np.broadcast_to(factor, robot.n + 1).astype(np.float64)
    second_moments_into(robot.model, coordinates, np.ascontiguousarray(factors), out)
    return out
