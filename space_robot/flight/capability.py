"""Capability of actuators: torque and momentum about an axis, propellant for a torque.

Wheels give torques along their axes either way, thrusters theirs one way; each has its limit.
"""

from __future__ import annotations

from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array, product, unit_rows
from space_robot_model.hardware.base_actuators import (
    BaseActuatorSettings,
    ThrusterSettings,
    WheelSettings,
)
from space_robot_model.robot.placements import to_base, to_inertial
from space_robot_msgs_py.errors import InputError

BATCH = 8192
"""Ticks at a time; this bounds the memory."""
PARALLEL = 1e-9
"""Share of two torques' product below which they are along one line."""
FLATNESS = 1e-6
"""Share of the largest torque that counts as none."""


def largest_torque(hardware: BaseActuatorSettings) -> Array:
    """(3,) N m that wheels and thrusters can give about each axis both ways, and no other torque.

    However they share it: a linear programme, see `_largest`.
    """
    rows, low, high = _reach(hardware)
    return _largest(rows.T, low, high)


def _reach(hardware: BaseActuatorSettings) -> tuple[Array, Array, Array]:
    """Return torques (A, 3) of wheels, for 1 N m, and of thrusters, and limits of their factors."""
    wheels, thrusters = hardware.wheels, hardware.thrusters
    limit = wheels.limits("max_torque")
    low = np.concatenate([-limit, np.zeros(thrusters.count)])
    high = np.concatenate([limit, np.ones(thrusters.count)])
    return np.vstack([wheels.unit_axes, thrusters.torques]), low, high


def largest_momentum(wheels: WheelSettings) -> Array:
    """(3,) N m s that wheels can hold about each axis both ways, and none about another."""
    limit = wheels.limits("max_momentum")
    return _largest(wheels.unit_axes.T, -limit, limit)


class ActuatorLoad(NamedTuple):
    """What a motion asks of actuators, at K times; a share of 1 is all that they have."""

    torque: Array
    """(K, 3) N m, base axes: asked of them, with the turning of the wheels' momentum."""
    torque_share: Array
    """(K,) of the torque that they can give in that direction."""
    momentum_share: Array
    """(K,) of the momentum that they can hold; 0 where thrusters can unload the wheels."""


def actuator_load(
    hardware: BaseActuatorSettings, torque: Array, momentum: Array, omega: Array
) -> ActuatorLoad:
    """Return what is asked of actuators that turn a base; all on its axes.

    ``torque`` (K, 3) N m; ``momentum`` (K, 3) N m s, that the base has been given, less
    `carried_momentum`; ``omega`` (K, 3) rad/s. Wheels alone share a torque as the allocation does,
    see `wheel_loads`; thrusters, and thrusters with wheels, in the best way.
    """
    wheels, nothing = hardware.wheels, np.zeros(len(torque))
    if hardware.thruster_count:
        spaces = _half_spaces(*_reach(hardware))
        return ActuatorLoad(torque, _largest_product(spaces, torque), nothing)
    motors, held = wheel_loads(wheels, torque, -momentum, omega)
    turning = np.cross(omega, product(held, wheels.unit_axes))
    shares = [
        np.max(np.abs(values) / wheels.limits(name), axis=1)
        for values, name in ((motors, "max_torque"), (held, "max_momentum"))
    ]
    return ActuatorLoad(torque + turning, *shares)


def wheel_loads(
    wheels: WheelSettings, torque: Array, momentum: Array, omega: Array
) -> tuple[Array, Array]:
    """Return torque (K, W), N m, of each wheel's motor, and momentum (K, W), N m s, of each wheel.

    The motors give what changes the wheels' momentum, the turning of the base under it included,
    and what friction takes: ``u = -P (tau + w x h) + f``, with P of `wheel_shares`.

    On the base's axes: its ``torque`` tau (K, 3), N m; the ``momentum`` (K, 3), N m s, that the
    wheels together have got since their initial speeds, see `carried_momentum`; its ``omega`` w
    (K, 3), rad/s.
    """
    shares = wheel_shares(wheels)
    held = product(momentum, shares.T) + wheels.spin_momenta(wheels.values("initial_speed"))
    turning = np.cross(omega, product(held, wheels.unit_axes))
    speed = held / wheels.values("rotor_inertia")
    friction = wheels.values("coulomb") * np.sign(speed) + wheels.values("viscous") * speed
    return -product(torque + turning, shares.T) + friction, held


def carried_momentum(wheels: WheelSettings, start: Array, axes: Array) -> Array:
    """(K, 3) N m s, base axes, that wheels must get to keep their first momentum on inertial axes.

    ``start`` (3, 3, 1) and ``axes`` (3, 3, K): the base's axes at the start and later, see
    `base_axes`.
    """
    speeds = wheels.values("initial_speed")
    spin = np.sum(wheels.spin_momenta(speeds)[:, None] * wheels.unit_axes, axis=0)
    held: Array = to_base(axes, to_inertial(start, spin[:, None])).T - spin
    return held


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

    torque_spaces: Array
    """(K, 3) 1/(N m): a torque within all of them can be had of thrusters that are partly open."""
    mass_flow_spaces: Array
    """(L, 3) s/(N m): the largest ``normal . tau`` is the least propellant for it, kg/s."""

    @classmethod
    def of(cls, thrusters: ThrusterSettings) -> ThrusterTorques:
        """Find the half-spaces of thrusters that can give a torque in any direction.

        The torques for 1 kg/s are the convex hull of what each thruster gives for it.
        """
        from scipy.spatial import ConvexHull, QhullError  # slow to import

        torques = thrusters.torques
        spaces = _half_spaces(torques, np.zeros(thrusters.count), np.ones(thrusters.count))
        try:
            hull = ConvexHull(torques / thrusters.mass_flow[:, None]).equations
        except QhullError:
            raise InputError("the thrusters' torques hardly span all directions") from None
        return cls(spaces, -hull[:, :3] / hull[:, 3:])

    def share(self, torque: Array) -> Array:
        """(N,) share of what can be given in the direction of each torque (N, 3), N m."""
        return _largest_product(self.torque_spaces, torque)

    def propellant(self, torque: Array) -> Array:
        """(N,) kg/s, the least that gives each torque (N, 3), N m, were the valves continuous."""
        return _largest_product(self.mass_flow_spaces, torque)


def _half_spaces(torques: Array, low: Array, high: Array) -> Array:
    """Return (K, 3) 1/(N m), for a ``torque`` within all: ``row . torque <= 1``.

    All torques ``sum x_i torques_i`` with ``low <= x <= high`` are a zonotope, whose faces are
    spanned by two of the rows (A, 3). Of a flat one, as of couples about one axis, the thickness
    is `FLATNESS` of the largest torque: whatever is out of its plane is too much.
    """
    _, spread, axes = np.linalg.svd(torques)
    missing = axes[np.count_nonzero(spread > PARALLEL * spread[0]) :] * (spread[0] or 1.0)
    torques = np.vstack([torques, missing])
    thin = np.full(len(missing), FLATNESS)
    low, high = np.append(low, -thin), np.append(high, thin)
    sizes = np.linalg.norm(torques, axis=1)
    turning = torques[sizes > PARALLEL * sizes.max()]
    pairs = np.array([np.cross(a, b) for a, b in combinations(turning, 2)])
    length = np.linalg.norm(pairs, axis=1)
    faces = pairs[length > PARALLEL * length.max()]
    normals = _unlike(np.vstack([faces, -faces]))
    along = normals @ torques.T
    is_across = np.abs(along) <= PARALLEL * sizes  # of no use, though its limit were infinite
    parts = np.where(along > 0.0, high, low) * np.where(is_across, 1.0, along)
    reach = np.sum(parts, axis=1, where=~is_across)
    spaces: Array = normals / reach[:, None]
    return spaces


def _unlike(vectors: Array) -> Array:
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
