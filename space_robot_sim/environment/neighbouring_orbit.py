"""A target on a neighbouring orbit, from tick 0 to its capture.

It falls freely beside the reference point and tumbles under the gravity gradient. For distances far
below that from the Earth's centre its motion is that of Hill's equations (Clohessy & Wiltshire,
"Terminal guidance system for satellite rendezvous", J. Aerospace Sciences 27(9), 1960).
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import quaternion_rate, rotation_matrix
from space_robot_model.elementary.matrices import norm, product, solve
from space_robot_model.orbit.elements import MU, hill_axes, state_of
from space_robot_model.orbit.propagation import gravity
from space_robot_model.robot.inertia import inertia_tensor
from space_robot_msgs_py.errors import InputError

from .orbit import OrbitSettings
from .target import Target, TargetMotion

Array = NDArray[np.float64]

STEP, LONGEST_STEP = 5.0, 20.0
"""Usual and longest step of the integrator, s."""
TURN, LARGEST_TURN = 0.05, 0.1
"""Usual and largest angle by which a target turns in a step, rad."""
MOST_STEPS = 50_000


class TargetState(NamedTuple):
    """Place and motion of a target in free fall, as its capture needs them."""

    position: Array
    """(3,) of its centre of mass from the inertial frame's origin, m, inertial axes."""
    motion: TargetMotion
    """Relative to the inertial frame."""
    reach: float
    """Largest distance from where the tool holds it, m."""


def target_state(target: Target, orbit: OrbitSettings, time: float) -> TargetState:
    """Return where ``target`` is at ``time``, s, and how it moves."""
    (x,) = _states(target, orbit, np.array([time]))
    rotation = np.empty((3, 3))
    rotation_matrix(x[12:16], rotation)
    return TargetState(
        x[6:9],
        TargetMotion.model_construct(  # it may be faster by now than a file may say
            relative_to="inertial",
            velocity=x[9:12].tolist(),
            angular_velocity=product(rotation, x[16:19]).tolist(),
        ),
        target.motion.reach,
    )


def free_fall(target: Target, orbit: OrbitSettings, times: Array) -> tuple[Array, Array]:
    """Return the poses of ``target`` in free fall, integrated as in `target_state`.

    Args:
        target: on a neighbouring orbit.
        orbit: of the inertial frame's origin.
        times: (K,) s, ascending from 0 on.

    Returns:
        (K, 3) centre of mass, m, inertial frame; (K, 4) attitude ``[w, x, y, z]``.
    """
    states = np.array([*_states(target, orbit, times)]).reshape(-1, 19)
    return states[:, 6:9], states[:, 12:16]


def _states(target: Target, orbit: OrbitSettings, times: Array) -> Iterator[Array]:
    x, now = _at_tick_0(target, orbit), 0.0
    inertia, has_j2 = inertia_tensor(target.inertia), float(orbit.gravity.j2)
    for time in times.tolist():
        # equal steps that end at each time, so that no pose is interpolated
        steps = _steps(target, time - now)
        for _ in range(steps):
            x = _step(x, (time - now) / steps, inertia, has_j2)
        now = time
        yield x


def _at_tick_0(target: Target, orbit: OrbitSettings) -> Array:
    if not orbit.has_orbit:
        raise InputError(
            f"target {target.name!r}: motion.relative_to orbit needs an orbit: --orbit NAME"
        )
    motion = target.motion
    origin, velocity = state_of(orbit.orbital_elements)
    axes = hill_axes(origin, velocity)
    rate = np.array([0.0, 0.0, norm(np.cross(origin, velocity)) / norm(origin) ** 2])
    # the orbit's axes turn: what is seen from them lacks omega x r
    relative = np.array(motion.velocity) + np.cross(rate, motion.position)
    quaternion = np.array(motion.quaternion)
    return np.concatenate(
        [
            *(origin, velocity, product(axes, motion.position), product(axes, relative)),
            *(quaternion / norm(quaternion), motion.angular_velocity),
        ]
    )


def _steps(target: Target, time: float) -> int:
    rate = norm(target.motion.angular_velocity)
    usual = min(STEP, TURN / rate) if rate else STEP
    steps = math.ceil(time / usual)
    if steps <= MOST_STEPS:
        return steps
    step = time / MOST_STEPS
    if step > LONGEST_STEP or step * rate > LARGEST_TURN:
        raise InputError(
            f"target {target.name!r}: motion.angular_velocity: a target that turns with {rate:g} "
            f"rad/s cannot be followed for {time:g} s: capture it before "
            f"{MOST_STEPS * min(LONGEST_STEP, LARGEST_TURN / rate if rate else math.inf):.3g} s"
        )
    return MOST_STEPS


def _step(x: Array, step: float, inertia: Array, has_j2: float) -> Array:
    """Return the state a step of Runge and Kutta's method later."""
    first = _rates(x, inertia, has_j2)
    second = _rates(x + 0.5 * step * first, inertia, has_j2)
    third = _rates(x + 0.5 * step * second, inertia, has_j2)
    fourth = _rates(x + step * third, inertia, has_j2)
    after: Array = x + step / 6.0 * (first + 2.0 * (second + third) + fourth)
    after[12:16] /= norm(after[12:16])
    return after


def _rates(x: Array, inertia: Array, has_j2: float) -> Array:
    """Return xdot of ``[R, V, d, ddot, quaternion, omega]``; omega on the target's axes."""
    out, rotation = np.empty(19), np.empty((3, 3))
    quaternion, omega = x[12:16], x[16:19]
    rotation_matrix(quaternion / norm(quaternion), rotation)
    out[0:3], out[6:9] = x[3:6], x[9:12]
    place = x[0:3] + x[6:9]
    gravity(np.ascontiguousarray(x[0:3]), has_j2, out[3:6])
    gravity(place, has_j2, out[9:12])
    out[9:12] -= out[3:6]
    distance = norm(place)
    up = product(place / distance, rotation)
    torque = 3.0 * MU / distance**3 * np.cross(up, product(inertia, up))
    quaternion_rate(quaternion, product(rotation, omega), out[12:16])
    out[16:19] = solve(inertia, torque - np.cross(omega, product(inertia, omega)))
    return out
