"""Unloading of the wheels: thrusters in turns, magnetic torquers all the time.

Magnetic torquers follow the cross-product law (Camillo & Markley, "Orbit-averaged behavior of
magnetic control laws for momentum unloading", J. Guidance and Control 3(6), 1980)

    m = k (h x B) / |B|^2        turns the base with    m x B = -k (h - (h . b) b),  b = B / |B|

takes the momentum h across the field from the wheels, with time constant 1/k; along an orbit the
field turns, and no direction is left out. Beyond the largest dipoles m keeps its direction.

Thrusters begin when a wheel is full beyond a share, and end below another one.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.algebra import Vector, add, cross, dot, scale, store, vector
from space_robot_model.hardware.base_actuators import MagneticTorquerSettings
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, assign, shaped
from space_robot_msgs_py.samples import MOST_TORQUERS

from .settings import AllocationSettings
from .wheels import AssumedWheels, stored_momentum

Array = NDArray[np.float64]

LEAST_FIELD = 1e-10
"""Field below which torquers are left alone, T: 1e-5 of the Earth's in a low orbit."""
WHEELS_SHARE = 0.5
"""Share of the wheels' torque available to unloading."""


class AssumedTorquers(Record):
    """Magnetic torquers of one base as assumed by the flight software."""

    count: float = shaped(lambda n: ())
    gain: float = shaped(lambda n: (), "k, 1/s")
    axis: Array = shaped(lambda n: (MOST_TORQUERS, 3), "Unit vectors, base frame")
    inverse: Array = shaped(lambda n: (MOST_TORQUERS, 3))
    """Dipole of each torquer by a dipole of the base: pseudo-inverse of the axes; 1."""
    max_dipole: Array = shaped(lambda n: (MOST_TORQUERS,), "A m2")
    magnetic_field: Array = shaped(lambda n: (3,), "As measured at the present tick, T, base frame")
    dipole: Array = shaped(lambda n: (MOST_TORQUERS,), "Commanded at the present tick, A m2")
    torque: Array = shaped(lambda n: (3,))
    """On the base, expected of them from the present tick to the next, N m, base frame."""

    @classmethod
    def build(
        cls, n: int, assumed: MagneticTorquerSettings, settings: AllocationSettings
    ) -> AssumedTorquers:
        """Read the numbers of the settings for a robot of ``n`` joints."""
        torquers, count = cls.allocate(n), assumed.count
        gain = settings.magnetic_gain if settings.dump in ("all", "magnetic") else 0.0
        assign(torquers, count=count, gain=gain)
        torquers.axis[:count] = assumed.unit_axes
        torquers.max_dipole[:count] = assumed.values("max_dipole")
        if count:
            torquers.inverse[:count] = np.linalg.pinv(assumed.unit_axes.T)
        return torquers


@kernel
def dump_momentum(torquers: AssumedTorquers, momentum: Vector) -> None:
    """Write the ``dipole`` of each torquer, and their ``torque``.

    ``momentum`` is that of the wheels, N m s, base frame.
    """
    field = vector(torquers.magnetic_field, 0)
    square = dot(field, field)
    # m = k (h x B) / |B|^2
    rate = torquers.gain / square if square > LEAST_FIELD * LEAST_FIELD else 0.0
    wanted = scale(cross(momentum, field), rate)
    excess = 1.0
    for k in range(int(torquers.count)):
        torquers.dipole[k] = dot(vector(torquers.inverse[k], 0), wanted)
        excess = max(excess, abs(torquers.dipole[k]) / torquers.max_dipole[k])
    total = (0.0, 0.0, 0.0)
    for k in range(int(torquers.count)):
        load = torquers.dipole[k] / torquers.max_dipole[k]
        dipole = load / excess * torquers.max_dipole[k]  # no dipole is above its limit
        torquers.dipole[k] = dipole
        total = add(total, scale(vector(torquers.axis[k], 0), dipole))
    store(cross(total, field), torquers.torque, 0)


class Unloading(Record):
    """Settings and state of the unloading by thrusters."""

    above: float = shaped(lambda n: (), "Share of the largest momentum at which unloading begins")
    to: float = shaped(lambda n: (), "Share of the largest momentum at which unloading stops")
    rate: float = shaped(lambda n: (), "1/s")
    is_active: float = shaped(lambda n: (), "0 or 1")

    @classmethod
    def build(cls, n: int, settings: AllocationSettings) -> Unloading:
        """Read the settings."""
        unloading = cls.allocate(n)
        above = settings.unload_above if settings.dump in ("all", "thrusters") else np.inf
        assign(unloading, above=above, to=settings.unload_to, rate=1.0 / settings.unload_time)
        return unloading


@kernel
def find_unloading(unloading: Unloading, wheels: AssumedWheels, torque: Array) -> None:
    """Write the unloading ``torque`` (3,) N m for the thrusters, zero if inactive."""
    momentum, fullest = stored_momentum(wheels), 0.0
    for k in range(int(wheels.count)):
        fullest = max(fullest, abs(wheels.momentum[k]) / wheels.max_momentum[k])
    if fullest > unloading.above:
        unloading.is_active = 1.0
    elif fullest < unloading.to:
        unloading.is_active = 0.0
    # the wheels have to give what the thrusters take from them, beside the demand
    rate, excess = unloading.rate * unloading.is_active, 1.0
    for k in range(int(wheels.count)):
        load = abs(dot(vector(wheels.healthy.inverse[k], 0), momentum)) * rate
        excess = max(excess, load / (WHEELS_SHARE * wheels.max_torque[k]))
    store(scale(momentum, -rate / excess), torque, 0)
