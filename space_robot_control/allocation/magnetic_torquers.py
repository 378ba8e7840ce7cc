"""Unloading of the wheels by magnetic torquers.

The cross-product law (Camillo & Markley, "Orbit-averaged behavior of magnetic control laws for
momentum unloading", J. Guidance and Control 3(6), 1980)

    m = k (h x B) / |B|^2        turns the base with    m x B = -k (h - (h . b) b),  b = B / |B|

takes the momentum h across the field from the wheels, with time constant 1/k; along an orbit the
field turns, and no direction is left out. Beyond the largest dipoles m keeps its direction.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import MagneticTorquerSettings
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, assign, shaped
from space_robot_msgs_py.samples import MOST_TORQUERS

from .settings import AllocationSettings

Array = NDArray[np.float64]

LEAST_FIELD = 1e-10
"""Field below which torquers are left alone, T: 1e-5 of the Earth's in a low orbit."""


class AssumedTorquers(Record):
    """Magnetic torquers of one base as assumed by the flight software."""

    count: float = shaped(lambda n: ())
    gain: float = shaped(lambda n: ())
    """k, 1/s."""
    axis: Array = shaped(lambda n: (MOST_TORQUERS, 3))
    """Unit vectors, base frame."""
    inverse: Array = shaped(lambda n: (MOST_TORQUERS, 3))
    """Dipole of each torquer by a dipole of the base: pseudo-inverse of the axes; 1."""
    max_dipole: Array = shaped(lambda n: (MOST_TORQUERS,))
    """A m2."""
    magnetic_field: Array = shaped(lambda n: (3,))
    """As measured at the present tick, T, base frame."""
    dipole: Array = shaped(lambda n: (MOST_TORQUERS,))
    """Commanded at the present tick, A m2."""
    torque: Array = shaped(lambda n: (3,))
    """On the base, expected of them from the present tick to the next, N m, base frame."""

    @classmethod
    def build(
        cls, n: int, assumed: MagneticTorquerSettings, settings: AllocationSettings
    ) -> AssumedTorquers:
        """Read the numbers of the settings for a robot of ``n`` joints."""
        torquers, count = cls.allocate(n), assumed.count
        gain = settings.magnetic_gain if settings.torquers_unload else 0.0
        assign(torquers, count=count, gain=gain)
        torquers.axis[:count] = assumed.unit_axes
        torquers.max_dipole[:count] = assumed.values("max_dipole")
        if count:
            torquers.inverse[:count] = np.linalg.pinv(assumed.unit_axes.T)
        return torquers


@kernel
def dump_momentum(torquers: AssumedTorquers, x: float, y: float, z: float) -> None:
    """Write the ``dipole`` of each torquer, and their ``torque``.

    ``x, y, z`` are the momentum of the wheels, N m s, base frame.
    """
    field, torque = torquers.magnetic_field, torquers.torque
    square = field[0] * field[0] + field[1] * field[1] + field[2] * field[2]
    rate = torquers.gain / square if square > LEAST_FIELD * LEAST_FIELD else 0.0
    wanted_x = rate * (y * field[2] - z * field[1])
    wanted_y = rate * (z * field[0] - x * field[2])
    wanted_z = rate * (x * field[1] - y * field[0])
    excess = 1.0
    for k in range(int(torquers.count)):
        row = torquers.inverse[k]
        torquers.dipole[k] = row[0] * wanted_x + row[1] * wanted_y + row[2] * wanted_z
        excess = max(excess, abs(torquers.dipole[k]) / torquers.max_dipole[k])
    a, b, c = 0.0, 0.0, 0.0
    for k in range(int(torquers.count)):
        load = torquers.dipole[k] / torquers.max_dipole[k]
        dipole = load / excess * torquers.max_dipole[k]  # no dipole is above its limit
        torquers.dipole[k] = dipole
        a += dipole * torquers.axis[k, 0]
        b += dipole * torquers.axis[k, 1]
        c += dipole * torquers.axis[k, 2]
    torque[0] = b * field[2] - c * field[1]
    torque[1] = c * field[0] - a * field[2]
    torque[2] = a * field[1] - b * field[0]
