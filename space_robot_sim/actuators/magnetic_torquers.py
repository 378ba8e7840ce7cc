"""Magnetic torquers on the base: dipoles in the Earth's magnetic field.

A torquer gives the dipole that it is asked for, up to its largest one, at once: the time constant
of a coil, some 10 ms, is far below that of unloading. Its field does not reach the magnetometer.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where, whole
from space_robot_msgs_py.compiled.records import shaped
from space_robot_msgs_py.samples import MOST_TORQUERS

from ..component import Component

Array = NDArray[np.float64]


class MagneticTorquers(Component):
    """Magnetic torquers of one base; entries beyond the last one are zero."""

    count: float = shaped(lambda n: (), uniform=True, source="count")
    axis: Array = shaped(lambda n: (MOST_TORQUERS, 3), source="unit_axes")
    """Unit vectors of the dipoles, base frame."""
    max_dipole: Array = shaped(
        lambda n: (MOST_TORQUERS,), source=lambda s, at: s.values("max_dipole")
    )
    """A m2."""


@kernel
def magnetise(
    torquers: MagneticTorquers, asked: Array, magnetic_field: Array, base_wrench: Array
) -> None:
    """Add the torque of the dipoles (M,) asked for, A m2, over a tick to ``base_wrench``.

    The ``magnetic_field`` is that at the begin of the tick, T, base axes.
    """
    x, y, z = 0.0, 0.0, 0.0
    for k in range(whole(torquers.count)):
        most = torquers.max_dipole[k]
        # a command that is not a number asks for nothing
        dipole = where(np.isnan(asked[k]), 0.0, max(min(asked[k], most), -most))
        x += dipole * torquers.axis[k, 0]
        y += dipole * torquers.axis[k, 1]
        z += dipole * torquers.axis[k, 2]
    # torque m x B
    base_wrench[3] += y * magnetic_field[2] - z * magnetic_field[1]
    base_wrench[4] += z * magnetic_field[0] - x * magnetic_field[2]
    base_wrench[5] += x * magnetic_field[1] - y * magnetic_field[0]
