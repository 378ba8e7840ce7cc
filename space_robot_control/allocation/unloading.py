"""Momentum unloading of wheels by thrusters.

From the moment that a wheel has more than ``unload_above`` of its largest momentum until all have
less than ``unload_to``, thrusters are asked for the torque ``-H / unload_time``, H the wheels'
momentum, cut to half of what the wheels can give: these hold the base against it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, assign, shaped

from .settings import AllocationSettings
from .wheels import AssumedWheels

Array = NDArray[np.float64]

WHEELS_SHARE = 0.5
"""Share of the wheels' torque available to unloading."""


class Unloading(Record):
    """Settings and state of the unloading."""

    above: float = shaped(lambda n: ())
    to: float = shaped(lambda n: ())
    """Share of the largest momentum at which unloading stops."""
    rate: float = shaped(lambda n: ())
    """1/s."""
    is_active: float = shaped(lambda n: ())
    """0 or 1."""

    @classmethod
    def build(cls, n: int, settings: AllocationSettings) -> Unloading:
        """Read the settings."""
        unloading = cls.allocate(n)
        assign(
            unloading,
            above=settings.unload_above,
            to=settings.unload_to,
            rate=1.0 / settings.unload_time,
        )
        return unloading


@kernel
def find_unloading(unloading: Unloading, wheels: AssumedWheels, torque: Array) -> None:
    """Write the unloading ``torque`` (3,) N m for the thrusters, zero if inactive."""
    fullest, x, y, z = 0.0, 0.0, 0.0, 0.0
    for k in range(int(wheels.count)):
        h, axis = wheels.momentum[k], wheels.axis[k]
        fullest = max(fullest, abs(h) / wheels.max_momentum[k])
        x += axis[0] * h
        y += axis[1] * h
        z += axis[2] * h
    if fullest > unloading.above:
        unloading.is_active = 1.0
    elif fullest < unloading.to:
        unloading.is_active = 0.0
    rate, excess = unloading.rate * unloading.is_active, 1.0
    for k in range(int(wheels.count)):
        row = wheels.healthy.inverse[k]
        load = abs(row[0] * x + row[1] * y + row[2] * z) * rate
        excess = max(excess, load / (WHEELS_SHARE * wheels.max_torque[k]))
    torque[0] = -rate / excess * x
    torque[1] = -rate / excess * y
    torque[2] = -rate / excess * z
