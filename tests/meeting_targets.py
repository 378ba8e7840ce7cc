"""Targets on neighbouring orbits, what SciPy says of them, and those that a tool meets."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from oracles import rotation_of
from orbiting_robots import EARTH_RADIUS, J2, MU, body_places
from scipy.integrate import solve_ivp

from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import RobotState
from space_robot_sim.environment.neighbouring_orbit import meet
from space_robot_sim.environment.orbit_settings import OrbitSettings
from space_robot_sim.environment.target import Target

Array = NDArray[np.float64]

BODY: dict[str, Any] = {
    "name": "drifter",
    "mass": 80.0,
    "inertia": [6.0, 5.0, 4.0, 0.3, -0.2, 0.1],
    "place": {"position": [0.1, -0.05, 0.4], "quaternion": [0.8, 0.2, -0.4, 0.4]},
}


def target_of(**motion: Any) -> Target:
    """Return a target with a motion relative to the orbit."""
    return Target.from_dict({"target": {**BODY, "motion": {"relative_to": "orbit", **motion}}})


def tensor_of(target: Target) -> Array:
    """Return the inertia (3, 3) about the target's CoM, on its axes, kg m2."""
    return np.array(target.inertia)[[0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(3, 3)


def circular_orbit(height: float, **gravity: Any) -> OrbitSettings:
    """Return an inclined circular orbit."""
    elements = {"height": height, "inclination_deg": 51.6, "raan_deg": 40.0, "anomaly_deg": 75.0}
    return OrbitSettings.model_validate({"orbital_elements": elements, "gravity": gravity})


def held_place(robot: Robot, state: RobotState, target: Target) -> tuple[Array, Array]:
    """Return where a tool holds a target: its CoM (3,), m, and axes (3, 3), inertial axes.

    The robot's joints turn and have motors.
    """
    tool = robot.tool
    axes, origin = body_places(robot, state)[tool.body]
    hand, place = axes @ tool.rotation, target.place
    position = origin + axes @ tool.position + hand @ np.array(place.position)
    return position, hand @ rotation_of(place.quaternion).as_matrix()


def meeting_target(orbit: OrbitSettings, time: float, place: ArrayLike, **motion: Any) -> Target:
    """Return a target that is at ``place`` (3,), m, inertial axes, at ``time``, s.

    Its position at time 0 is corrected linearly until nothing is left of the miss.
    """
    position, step = np.zeros(3), 1.0

    def miss(start: Array) -> Array:
        target = target_of(**{**motion, "position": start.tolist()})
        return meet(target, orbit, time).position - np.asarray(place)

    for _ in range(3):
        now = miss(position)
        slopes = [(miss(position + step * axis) - now) / step for axis in np.eye(3)]
        position = position - np.linalg.solve(np.column_stack(slopes), now)
    assert np.linalg.norm(miss(position)) < 1e-7
    return target_of(**{**motion, "position": position.tolist()})


def fall(position: Array, has_j2: bool) -> Array:
    """Return the acceleration of free fall (3,), m/s2."""
    r = float(np.linalg.norm(position))
    pull = -MU / r**3 * position
    if has_j2:
        height = 5.0 * position[2] ** 2 / r**2
        factor = -1.5 * J2 * MU * EARTH_RADIUS**2 / r**5
        pull = pull + factor * position * (np.array([1.0, 1.0, 3.0]) - height)
    return np.asarray(pull)


def free_path(position: ArrayLike, velocity: ArrayLike, time: float, has_j2: bool) -> Array:
    """Return position and velocity (6,) of a point after some time; both about the Earth."""

    def rates(_: float, x: Array) -> Array:
        return np.concatenate([x[3:], fall(x[:3], has_j2)])

    start = np.concatenate([position, velocity])
    path = solve_ivp(rates, (0.0, time), start, method="DOP853", rtol=1e-13, atol=1e-9)
    return np.asarray(path.y[:, -1])


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
