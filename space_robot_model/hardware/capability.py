"""Capability of actuators: torque and momentum about an axis, propellant for a torque.

Wheels give torques along their axes either way, thrusters theirs one way; each has its limit.
"""

from __future__ import annotations

from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.thrusters import ThrusterSettings
from space_robot_model.hardware.wheels import WheelSettings
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]

BATCH = 8192
"""Ticks at a time; this bounds the memory."""
PARALLEL = 1e-9
"""Share of two torques' product below which they are along one line."""


def largest_torque(hardware: BaseActuatorSettings) -> Array:
    """(3,) N m that wheels and thrusters can give about each axis both ways, and no other torque.

    However they share it: a linear programme, see `_largest`.
    """
    wheels, thrusters = hardware.wheels, hardware.thrusters
    columns, limit = np.vstack([wheels.unit_axes, thrusters.torques]).T, wheels.limits("max_torque")
    high = np.concatenate([limit, np.ones(thrusters.count)])
    low = np.concatenate([-limit, np.zeros(thrusters.count)])
    return _largest(columns, low, high)


def largest_momentum(wheels: WheelSettings) -> Array:
    """(3,) N m s that wheels can hold about each axis both ways, and none about another."""
    limit = wheels.limits("max_momentum")
    return _largest(wheels.unit_axes.T, -limit, limit)


def limits_of(hardware: BaseActuatorSettings) -> tuple[Array, Array]:
    """(3,) N m and (3,) N m s: the largest torque and momentum about each axis.

    Where thrusters can unload the wheels, momentum has no limit.
    """
    momentum = np.full(3, np.inf)
    if hardware.wheel_count and not hardware.thruster_count:
        momentum = largest_momentum(hardware.wheels)
    return largest_torque(hardware), momentum


def shares_of(limit: Array, asked: Array) -> Array:
    """(K, 3) what is ``asked`` (K, 3) about each axis, as shares of a limit (3,), maybe 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(asked == 0.0, 0.0, np.abs(asked) / limit)


def wheel_shares(wheels: WheelSettings) -> Array:
    """(W, 3) what each wheel has of a torque or momentum by least squares of the loads.

    As the allocation shares it: a load is a torque over the motor's largest one; where a motor has
    no limit, all count alike.
    """
    limit = wheels.limits("max_torque")
    load = limit if np.all(np.isfinite(limit)) else np.ones(wheels.count)
    return np.asarray(load[:, None] * np.linalg.pinv(wheels.unit_axes.T * load))


def _largest(columns: Array, low: Array, high: Array) -> Array:
    """Return (3,) the largest s with ``columns x = +-s e_i`` for some ``low <= x <= high``."""
    from scipy.optimize import linprog  # slow to import

    count = columns.shape[1]
    limits = np.zeros((2, 3))
    for side, i in np.ndindex(2, 3):
        wanted = np.zeros((3, 1))
        wanted[i] = 1.0 if side else -1.0
        bounds: Any = [*zip(low, high, strict=True), (0.0, None)]
        solved: Any = linprog(
            np.append(np.zeros(count), -1.0),
            A_eq=np.hstack([columns, -wanted]),
            b_eq=np.zeros(3),
            bounds=bounds,
        )
        limits[side, i] = np.inf if solved.status == 3 else -solved.fun if solved.success else 0.0
    both: Array = limits.min(axis=0)
    return both


class ThrusterTorques(NamedTuple):
    """The torques that thrusters can give together, as half-spaces ``normal . tau <= 1``."""

    of_all: Array
    """(K, 3) 1/(N m): a torque within all of them can be had of thrusters that are partly open."""
    of_mass: Array
    """(L, 3) s/(N m): the largest ``normal . tau`` is the least propellant for it, kg/s."""

    @classmethod
    def of(cls, thrusters: ThrusterSettings) -> ThrusterTorques:
        """Find the half-spaces of thrusters that can give a torque in any direction.

        All torques are a zonotope, whose faces are spanned by two of the thrusters' torques. The
        torques for 1 kg/s are the convex hull of what each thruster gives for it.

        Raises:
            InputError: they are too unlike one another for that.
        """
        from scipy.spatial import ConvexHull, QhullError  # slow to import

        torques = thrusters.torques
        sizes = np.linalg.norm(torques, axis=1)
        turning = torques[sizes > PARALLEL * sizes.max()]
        pairs = np.array([np.cross(a, b) for a, b in combinations(turning, 2)])
        length = np.linalg.norm(pairs, axis=1)
        faces = pairs[length > PARALLEL * length.max()]
        normals = _unlike(np.vstack([faces, -faces]))
        reach = np.sum(np.maximum(normals @ torques.T, 0.0), axis=1)
        try:
            hull = ConvexHull(torques / thrusters.mass_flow[:, None]).equations
        except QhullError:
            raise InputError("the thrusters' torques hardly span all directions") from None
        return cls(normals / reach[:, None], -hull[:, :3] / hull[:, 3:])

    def share(self, torque: Array) -> Array:
        """(N,) share of what can be given in the direction of each torque (N, 3), N m."""
        return _largest_product(self.of_all, torque)

    def propellant(self, torque: Array) -> Array:
        """(N,) kg/s, the least that gives each torque (N, 3), N m, were the valves continuous."""
        return _largest_product(self.of_mass, torque)


def _unlike(vectors: Array) -> Array:
    """Return vectors (K, 3) as unit vectors, of equal ones the first."""
    unit = unit_rows(vectors)
    _, first = np.unique(np.round(unit, 9), axis=0, return_index=True)
    kept: Array = unit[first]
    return kept


def _largest_product(normals: Array, vectors: Array) -> Array:
    products = np.empty(len(vectors))
    for start in range(0, len(vectors), BATCH):
        part = slice(start, start + BATCH)
        products[part] = np.maximum(np.max(vectors[part] @ normals.T, axis=1), 0.0)
    return products
