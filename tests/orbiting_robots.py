"""Robots in orbit around the Earth, and what must be conserved there.

The constants and formulas are written out here once more, so that they can be compared with.
"""

from __future__ import annotations

from collections.abc import Sequence
from decimal import Decimal, localcontext
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray
from oracles import pinocchio_model, pinocchio_state, rotation_of
from random_robots import State

from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.plant.plant import Plant, PlantSettings
from space_robot_sim.plant.tick import update_true_state

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
MOTORS = 6
"""As many as the paper's robot has, whose compiled kernels serve."""
ANGLES_DEG = [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]
BALL_MASS, BALL_INERTIA = 1e-3, 1e-6
LOCKED = FrictionSettings(coulomb=1e6, viscous=0.0)
"""No joint breaks away: the robot is rigid."""
NO_FRICTION = FrictionSettings(coulomb=0.0, viscous=0.0)
KEPLER = {"gradient": True, "j2": False}
"""Settings of a gravity that knows no oblateness."""


def rigid_robot(mass: float, principal: Sequence[float], **base: Any) -> Robot:
    """Return a base with balls of a gram at its centre of mass, which are its links.

    Args:
        mass: of the whole, kg.
        principal: (3,) principal moments of inertia of the whole on the base's axes, kg m2.
        base: further keys of ``robot`` in its file.
    """
    ball = [BALL_INERTIA] * 3 + [0.0] * 3
    links = [
        {"name": f"ball{k}", "mass": BALL_MASS, "inertia": ball, "com": [0.0] * 3, "parent": "base"}
        for k in range(MOTORS)
    ]
    inertia = [moment - MOTORS * BALL_INERTIA for moment in principal] + [0.0] * 3
    body = {"mass": mass - MOTORS * BALL_MASS, "inertia": inertia}
    return Robot.from_dict({"robot": {"name": "rigid", "base": body, "links": links, **base}})


def orbiting_plant(robot: Robot, period: float, **settings: Any) -> Plant:
    """Return a plant in a circular orbit at 400 km, or what the settings say; nobody turns it."""
    orbit = {"orbital_elements": {"height": 400e3}, "gravity": KEPLER}
    joints = {"initial_joints_deg": [0.0] * robot.n, "friction": LOCKED}
    usual = {"base_actuation": "none", **joints, **orbit}
    return Plant(robot, PlantSettings.model_validate({**usual, **settings}), period)


def set_motion(
    plant: Plant,
    position: ArrayLike = (0.0, 0.0, 0.0),
    velocity: ArrayLike = (0.0, 0.0, 0.0),
    omega: ArrayLike = (0.0, 0.0, 0.0),
    joint_rates: ArrayLike = 0.0,
) -> None:
    """Give base and joints of a plant a motion; all on inertial axes, from the orbit's point."""
    n, x = plant.robot.joint_count, plant.memory.x
    x[:3], x[7 + n : 10 + n], x[10 + n : 13 + n] = position, velocity, omega
    x[13 + n : 13 + 2 * n] = joint_rates
    update_true_state(plant.block, plant.tick, plant.period)


def set_orbit(plant: Plant, position: ArrayLike, velocity: ArrayLike) -> None:
    """Put the orbit's point of a plant without wheels and gears elsewhere."""
    at = 13 + 2 * plant.robot.joint_count
    plant.memory.x[at : at + 3], plant.memory.x[at + 3 : at + 6] = position, velocity
    update_true_state(plant.block, plant.tick, plant.period)


def coast(plant: Plant, ticks: int) -> RobotState:
    """Fly on without any command and return the true state, which is overwritten in flight."""
    nothing = np.zeros(len(plant.names.commanded))
    for _ in range(ticks):
        plant.step(Command(plant.tick, nothing))
    return plant.truth


def mean_motion(semi_major_axis: float) -> float:
    """Return ``sqrt(mu / a^3)``, rad/s."""
    return float(np.sqrt(MU / semi_major_axis**3))


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


def body_motions(robot: Robot, state: RobotState) -> list[BodyMotion]:
    """Return the motion of all bodies by Pinocchio; of a chain of joints with motors."""
    turn = rotation_of(state.quaternion)
    model = pinocchio_model(robot)
    data = model.createData()
    configuration, velocity = pinocchio_state(
        State(
            state.quaternion,
            state.joint_positions,
            state.base_velocity,
            turn.apply(state.omega_base),
            state.joint_velocities,
        ),
        state.base_position,
    )
    pin.forwardKinematics(model, data, configuration, velocity)
    bodies = []
    for joint in range(1, model.njoints):
        place, own = data.oMi[joint], model.inertias[joint]
        twist = place.act(data.v[joint])
        position = place.act(own.lever)
        inertia = place.rotation @ own.inertia @ place.rotation.T
        spin = inertia @ twist.angular
        bodies.append(
            BodyMotion(
                own.mass,
                position,
                twist.linear + np.cross(twist.angular, position),
                inertia,
                spin,
                float(0.5 * twist.angular @ spin),
            )
        )
    return bodies


def body_places(robot: Robot, state: RobotState) -> list[tuple[Array, Array]]:
    """Return axes (3, 3), as columns, and origin (3,) of all bodies, from the orbit's point.

    Of a robot whose joints turn and have motors.
    """
    turn = rotation_of(state.quaternion).as_matrix()
    places = [(turn, np.array(state.base_position))]
    for joint in range(robot.n):
        axes, origin = places[int(robot.parent[joint])]
        across = axes @ robot.rotation[joint]
        angle = state.joint_positions[joint]
        spin = np.array(
            [[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0, 0, 1.0]]
        )
        places.append((across @ spin, origin + across @ robot.offset[joint]))
    return places


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


def across(a: Exact, b: Exact) -> Exact:
    """Return ``a x b``."""
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


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


def earth_potential(r: Exact, has_j2: bool) -> Decimal:
    """Return ``-mu / r (1 - J2 (R_E / r)^2 P_2(z / r))``, m2/s2."""
    square = times(r, r)
    distance = square.sqrt()
    potential = -Decimal(MU) / distance
    if has_j2:
        legendre = (3 * r[2] * r[2] / square - 1) / 2
        potential *= 1 - Decimal(J2) * Decimal(EARTH_RADIUS) ** 2 / square * legendre
    return potential


class EarthTotals(NamedTuple):
    """What a robot has about the Earth's centre, less what its mass would have at the point."""

    energy: float
    """J."""
    angular: Array
    """(3,) N m s."""
    whole_energy: Decimal
    """Nothing subtracted, J."""
    whole_angular: Exact
    """Nothing subtracted, N m s."""


def earth_totals(robot: Robot, state: RobotState, has_j2: bool) -> EarthTotals:
    """Return energy and angular momentum of all bodies about the Earth's centre.

    Those of the whole are some 1e10 J and 1e12 N m s, so that the rounding of a position of 7e6 m
    hides what the bodies exchange. What a particle of the same mass has at the orbit's point is
    conserved by itself, and is subtracted; computed with many digits.
    """
    with localcontext() as context:
        context.prec = DIGITS
        point, motion = exact(state.orbit_position), exact(state.orbit_velocity)
        energy, angular = Decimal(0), exact(np.zeros(3))
        mass = Decimal(0)
        for body in body_motions(robot, state):
            mass += (m := Decimal(body.mass))
            place = plus(point, exact(body.position))
            velocity = plus(motion, exact(body.velocity))
            energy += m * (times(velocity, velocity) / 2 + earth_potential(place, has_j2))
            energy += Decimal(body.energy) + _extent(place, body)
            orbital = across(place, velocity)
            angular = plus(angular, (m * orbital[0], m * orbital[1], m * orbital[2]))
            angular = plus(angular, exact(body.spin))
        of_point = mass * (times(motion, motion) / 2 + earth_potential(point, has_j2))
        about = across(point, motion)
        less = [float(a - mass * b) for a, b in zip(angular, about, strict=True)]
        return EarthTotals(float(energy - of_point), np.array(less), energy, angular)


def _extent(place: Exact, body: BodyMotion) -> Decimal:
    """Return the potential of a body's extent, ``mu / (2 r^3) (3 u . I u - tr I)``, J."""
    r = np.array([float(value) for value in place])
    distance = float(np.linalg.norm(r))
    u = r / distance
    moments = 3.0 * u @ body.inertia @ u - np.trace(body.inertia)
    return Decimal(float(MU / (2.0 * distance**3) * moments))


def centre_of_mass(robot: Robot, state: RobotState) -> Array:
    """Return the common centre of mass (3,) from the orbit's point, m, inertial axes."""
    bodies = body_motions(robot, state)
    moment = np.sum([body.mass * body.position for body in bodies], axis=0)
    return np.asarray(moment / sum(body.mass for body in bodies))


def angular_momentum(robot: Robot, state: RobotState) -> Array:
    """Return the angular momentum (3,) about the common centre of mass, N m s, inertial axes."""
    bodies = body_motions(robot, state)
    mass, com = sum(body.mass for body in bodies), centre_of_mass(robot, state)
    velocity = np.sum([body.mass * body.velocity for body in bodies], axis=0) / mass
    total = np.zeros(3)
    for body in bodies:
        total += body.spin
        total += body.mass * np.cross(body.position - com, body.velocity - velocity)
    return total


def whole_inertia(robot: Robot, state: RobotState) -> Array:
    """Return the inertia (3, 3) of all bodies about the common centre of mass, kg m2."""
    com, total = centre_of_mass(robot, state), np.zeros((3, 3))
    for body in body_motions(robot, state):
        d = body.position - com
        total += body.inertia + body.mass * (d @ d * np.eye(3) - np.outer(d, d))
    return total
