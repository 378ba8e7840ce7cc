"""Orbits around the Earth, and robots in them: constants, formulas and conserved quantities.

They are written out here once more, so that the project's can be compared with them.
"""

from __future__ import annotations

from decimal import Decimal, localcontext
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

from oracles import pinocchio_model, pinocchio_state, visited
from oracles.momenta import state_of
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import RobotState

Exact = NDArray[np.object_]
"""A vector of many digits."""

MU = 3.986004418e14
"""m3/s2."""
EARTH_RADIUS = 6378137.0
"""m."""
J2 = 1.08262668e-3
EARTH_RATE = 7.292115e-5
"""rad/s."""
DIGITS = 50


class BodyMotion(NamedTuple):
    """One body, relative to the orbit's point, on inertial axes."""

    mass: float
    position: Array
    """(3,) of its centre of mass, m."""
    velocity: Array
    """(3,) m/s."""
    inertia: Array
    """(3, 3) about its centre of mass, kg m2."""
    spin: Array
    """(3,) its angular momentum about its centre of mass, N m s."""
    energy: float
    """Kinetic energy of its turning, J."""
    axes: Array
    """(3, 3) those of its frame, as columns."""
    origin: Array
    """(3,) of its frame, m."""

    @classmethod
    def of(
        cls, mass: float, position: Array, axes: Array, inertia: Array, velocity: Array, w: Array
    ) -> BodyMotion:
        """Of a body with its centre of mass at its origin, and its inertia on its axes."""
        turned = axes @ inertia @ axes.T
        spin = turned @ w
        energy = float(0.5 * w @ spin)
        return cls(mass, position, velocity, turned, spin, energy, axes, position)


def body_motions(robot: Robot, state: RobotState) -> list[BodyMotion]:
    """Return the motion of all bodies by Pinocchio, in the robot's order."""
    model = pinocchio_model(robot)
    data, moving = model.createData(), visited(robot, state_of(robot, state))
    pin.forwardKinematics(model, data, *pinocchio_state(moving, state.base_position))
    bodies = []
    for body in range(robot.joint_count + 1):
        number = 2 + robot.order.index(body - 1) if body else 1
        place, own = data.oMi[number], model.inertias[number]
        twist, position = place.act(data.v[number]), place.act(own.lever)
        velocity = twist.linear + np.cross(twist.angular, position)
        motion = BodyMotion.of(
            own.mass, position, place.rotation, own.inertia, velocity, twist.angular
        )
        bodies.append(motion._replace(origin=place.translation))
    return bodies


def body_places(robot: Robot, state: RobotState) -> list[tuple[Array, Array]]:
    """Return axes (3, 3), as columns, and origin (3,) of all bodies, from the orbit's point."""
    return [(body.axes, body.origin) for body in body_motions(robot, state)]


def exact(vector: ArrayLike) -> Exact:
    """Return the same numbers as decimal ones."""
    return np.array([Decimal(float(value)) for value in np.asarray(vector)])


def fall(r: Any, has_j2: bool) -> Any:
    """Return the acceleration by the textbook's formula (Vallado, equation 8-30), m/s2.

    As exactly as the numbers are.
    """
    kind, square = type(r[0]), r @ r
    distance = square.sqrt() if kind is Decimal else np.sqrt(square)
    pull = -kind(MU) / (square * distance) * r
    if has_j2:
        share = kind(1.5) * kind(J2) * kind(EARTH_RADIUS) ** 2 / square
        pull *= 1 + share * (np.array([1, 1, 3]) - 5 * r[2] * r[2] / square)
    return pull


def centre_of_mass(robot: Robot, state: RobotState) -> Array:
    """Return the common centre of mass (3,) from the orbit's point, m, inertial axes."""
    bodies = body_motions(robot, state)
    moment = np.sum([body.mass * body.position for body in bodies], axis=0)
    return np.asarray(moment / sum(body.mass for body in bodies))


def whole_momenta(bodies: list[BodyMotion]) -> tuple[Array, Array]:
    """Return linear and angular momentum about the inertial frame's origin."""
    linear = [body.mass * body.velocity for body in bodies]
    angular = [body.spin + body.mass * np.cross(body.position, body.velocity) for body in bodies]
    return np.sum(linear, axis=0), np.sum(angular, axis=0)


def exact_difference(r: ArrayLike, d: ArrayLike, has_j2: bool) -> Array:
    """Return ``g(r + d) - g(r)``, rounded at the end."""
    with localcontext() as context:
        context.prec = DIGITS
        return (fall(exact(r) + exact(d), has_j2) - fall(exact(r), has_j2)).astype(float)


def weight_torque(robot: Robot, state: RobotState, has_j2: bool) -> Array:
    """Return the torque (3,) of gravity about the common centre of mass, N m, inertial axes.

    Each body is drawn at its centre of mass, and turned and drawn by its inertia I's part of the
    potential, ``mu / (2 r^3) (3 u . I u - tr I)``.
    """
    com, total = centre_of_mass(robot, state), np.zeros(3)
    for body in body_motions(robot, state):
        r = state.orbit_position + body.position
        distance = float(np.linalg.norm(r))
        u = r / distance
        turned, rate = body.inertia @ u, 3.0 * MU / distance**3
        lift = turned + (0.5 * np.trace(body.inertia) - 2.5 * u @ turned) * u
        force = body.mass * exact_difference(state.orbit_position, body.position, has_j2)
        force -= rate / distance * lift
        total += np.cross(body.position - com, force) + rate * np.cross(u, turned)
    return total


def free_path(position: ArrayLike, velocity: ArrayLike, times: ArrayLike, has_j2: bool) -> Array:
    """Return positions and velocities (T, 6) of a point at some times; both about the Earth."""

    def rates(_: float, x: Array) -> Array:
        return np.concatenate([x[3:], fall(x[:3], has_j2)])

    start, at = np.concatenate([position, velocity]), np.atleast_1d(times)
    path = solve_ivp(rates, (0.0, at[-1]), start, "DOP853", at, rtol=1e-13, atol=1e-9)
    return np.asarray(path.y.T)
