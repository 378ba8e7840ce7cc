"""Orbits around the Earth, and robots in them: constants, formulas and conserved quantities.

They are written out here once more, so that the project's can be compared with them.
"""

from __future__ import annotations

from decimal import Decimal, localcontext
from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray
from scipy.integrate import solve_ivp

from oracles import pinocchio_model, pinocchio_state, rotation_of, visited
from oracles.momenta import state_of
from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import RobotState

Array = NDArray[np.float64]
Exact = tuple[Decimal, Decimal, Decimal]
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
    x, y, z = (Decimal(float(value)) for value in np.asarray(vector))
    return x, y, z


def plus(a: Exact, b: Exact) -> Exact:
    """Return ``a + b``."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def times(a: Exact, b: Exact) -> Decimal:
    """Return ``a . b``."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def exact_gravity(r: Exact, has_j2: bool) -> Exact:
    """Return the acceleration by the textbook's formula (Vallado, equation 8-30)."""
    square = times(r, r)
    distance = square.sqrt()
    fall = -Decimal(MU) / (square * distance)
    if not has_j2:
        return fall * r[0], fall * r[1], fall * r[2]
    share = Decimal("1.5") * Decimal(J2) * Decimal(EARTH_RADIUS) ** 2 / square
    height = 5 * r[2] * r[2] / square
    return (
        fall * r[0] * (1 + share * (1 - height)),
        fall * r[1] * (1 + share * (1 - height)),
        fall * r[2] * (1 + share * (3 - height)),
    )


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


def fall(position: Array, has_j2: bool) -> Array:
    """Return the acceleration of free fall (3,), m/s2."""
    r = float(np.linalg.norm(position))
    pull = -MU / r**3 * position
    if has_j2:
        height = 5.0 * position[2] ** 2 / r**2
        factor = -1.5 * J2 * MU * EARTH_RADIUS**2 / r**5
        pull = pull + factor * position * (np.array([1.0, 1.0, 3.0]) - height)
    return np.asarray(pull)


def exact_difference(r: ArrayLike, d: ArrayLike, has_j2: bool) -> Array:
    """Return ``g(r + d) - g(r)``, rounded at the end."""
    with localcontext() as context:
        context.prec = DIGITS
        at = exact(r)
        end, begin = exact_gravity(plus(at, exact(d)), has_j2), exact_gravity(at, has_j2)
        return np.array([float(a - b) for a, b in zip(end, begin, strict=True)])


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


def tumbled(
    inertia: Array, quaternion: ArrayLike, omega: ArrayLike, path: ArrayLike, time: float
) -> tuple[Array, Array]:
    """Return quaternion (4,) and angular velocity (3,), body axes, after some time.

    Euler's equations with the gravity gradient along a Keplerian path.

    Args:
        inertia: (3, 3) kg m2.
        quaternion: (4,) ``[w, x, y, z]`` at time 0.
        omega: (3,) rad/s at time 0, body axes.
        path: (6,) position and velocity at time 0 about the Earth.
        time: s.
    """

    def rates(_: float, x: Array) -> Array:
        q, w, r = x[:4] / np.linalg.norm(x[:4]), x[4:7], x[7:10]
        distance = float(np.linalg.norm(r))
        up = rotation_of(q).inv().apply(r / distance)
        torque = 3.0 * MU / distance**3 * np.cross(up, inertia @ up)
        return np.concatenate(
            [
                0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))]),
                np.linalg.solve(inertia, torque - np.cross(w, inertia @ w)),
                x[10:13],
                fall(r, has_j2=False),
            ]
        )

    start = np.concatenate([quaternion / np.linalg.norm(quaternion), omega, path])
    motion = solve_ivp(rates, (0.0, time), start, method="DOP853", rtol=1e-12, atol=1e-13)
    end = motion.y[:, -1]
    return end[:4] / np.linalg.norm(end[:4]), end[4:7]
