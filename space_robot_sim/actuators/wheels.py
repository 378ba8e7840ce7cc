"""Reaction wheels on the base, with limits of torque and momentum.

The motor of wheel k gives the torque ``u_k`` about its axis ``a_k``, the base gets ``-a_k u_k``.
It gives no more than its largest torque, nor more than would push the wheel past its largest
momentum ``h`` within a tick of T:

    -max(0, h + J Omega) / T <= u <= max(0, h - J Omega) / T

How the wheels' rotation acts on the robot, and their friction, is the dynamics'
(`space_robot_model.dynamics`).
"""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where, whole
from space_robot_msgs_py.compiled.records import shaped
from space_robot_msgs_py.samples import MOST_WHEELS

from ..component import Component
from ..faults.grammar import About, Argument, Kind, switch_on

Array = NDArray[np.float64]


class Wheels(Component):
    """Wheel motors of one base; entries beyond the last wheel are zero."""

    count: float = shaped(lambda n: (), uniform=True, source="count")
    axis: Array = shaped(lambda n: (MOST_WHEELS, 3), source="unit_axes")
    """Unit vectors in the base frame."""
    inertia: Array = shaped(
        lambda n: (MOST_WHEELS,), source=lambda s, at: s.values("rotor_inertia")
    )
    """J of each rotor about its axis, kg m2."""
    max_torque: Array = shaped(
        lambda n: (MOST_WHEELS,), source=lambda s, at: s.limits("max_torque")
    )
    """N m."""
    max_momentum: Array = shaped(
        lambda n: (MOST_WHEELS,), source=lambda s, at: s.limits("max_momentum")
    )
    """h, N m s."""
    failed: Array = shaped(lambda n: (MOST_WHEELS,))
    """1 for a wheel with a failed motor."""
    saturated: Array = shaped(lambda n: (MOST_WHEELS,))
    """1 for a wheel commanded to its limit or beyond in the last tick."""
    saturated_ticks: Array = shaped(lambda n: (MOST_WHEELS,))
    """Number of ticks with a saturated wheel."""

    FAULTS: ClassVar[tuple[Kind, ...]] = (
        Kind(
            "wheel_fail",
            Argument(about=About.WHEEL),
            "the motor of a reaction wheel has no torque: the wheel turns freely",
            "failed",
            switch_on,
        ),
    )


@kernel
def drive_wheels(
    wheels: Wheels, asked: Array, velocities: Array, period: float, torques: Array, base: Array
) -> float:
    """Write the motor torques over a tick into ``torques``; add the reaction on the base.

    Args:
        wheels: whose saturation is counted.
        asked: (W,) or more, torque asked of each motor, N m.
        velocities: (MOST_WHEELS,) relative to the base, rad/s.
        period: of a tick, s.
        torques: (MOST_WHEELS,) N m, written.
        base: (3,) torque on the base, N m, base axes.

    Returns:
        1 if a wheel is saturated, else 0.
    """
    any_saturated = 0.0
    for k in range(whole(wheels.count)):
        momentum, limit = wheels.inertia[k] * velocities[k], wheels.max_momentum[k]
        upper = min(wheels.max_torque[k], max(0.0, limit - momentum) / period)
        lower = -min(wheels.max_torque[k], max(0.0, limit + momentum) / period)
        torque = min(max(asked[k], lower), upper)
        # only in the sense of the command: a full wheel can be slowed down
        at_limit = where(asked[k] > 0.0, asked[k] >= upper, asked[k] <= lower)
        works = wheels.failed[k] == 0.0
        saturated = where(at_limit & (asked[k] != 0.0) & works, 1.0, 0.0)
        # without motor the wheel turns freely; its friction is the dynamics'
        torque = where(works, torque, 0.0)
        wheels.saturated[k] = saturated
        wheels.saturated_ticks[k] += saturated
        any_saturated = max(any_saturated, saturated)
        torques[k] = torque
        for i in range(3):
            base[i] -= wheels.axis[k, i] * torque
    return any_saturated
