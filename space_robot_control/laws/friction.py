"""What a law does about joint friction: feedforward along the reference, and integral action.

Gains of the laws that estimate no disturbance (Armstrong-Helouvry, Dupont & Canudas de Wit, A
survey of models, analysis tools and compensation methods for the control of machines with friction,
Automatica 30(7), 1994). They are zero unless they are given; then these laws have the bits that
they have without them.

The feedforward follows the desired rate, not the measured one, so that noise and the friction that
is assumed too large cannot excite a limit cycle. Its dead band ends where the motion begins.

An integral is held while it would grow and the actuator gives less than half of what the law asked
at the last tick: laws do not know limits, but what was applied. It grows no further than to twice a
limit. Thrusters that pulse count as at their limit between pulses, where it only falls.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import where

from .base import Array, LawMemory
from .gains import per_axis

HELD_BELOW = 0.5
"""Share of the command; with less applied, the actuator is at its limit."""


def integral_gain(unit: str, largest: float, per_inertia: bool = False) -> Any:
    """Declare the gain of an `IntegralMemory`."""
    return per_axis(
        "gain K_I of the integral of e",
        unit,
        search=(1e-3, largest),
        per_inertia=per_inertia,
        is_optional=True,
    )


def friction_gains() -> tuple[Any, Any, Any]:
    """Declare the gains of `add_friction`: viscous, coulomb, dead band; joints only."""
    return (
        per_axis(
            "viscous friction of the joint that is fed forward",
            "N m s/rad",
            search=(1e-3, 1e3),
            is_optional=True,
        ),
        per_axis(
            "Coulomb friction of the joint that is fed forward",
            "N m",
            search=(1e-3, 1e3),
            is_optional=True,
        ),
        per_axis(
            "desired rate up to which no Coulomb friction is fed forward",
            "rad/s",
            search=(1e-6, 1e-1),
            is_optional=True,
        ),
    )


class IntegralMemory(LawMemory):
    """The integral of the error."""

    integral: Array = per_axis("integral of K_I e, in the unit of what it is added to")


@kernel
def add_error(
    error: Array, k_i: Array, applied: Array, last_force: Array, integral: Array, period: float
) -> None:
    """Add a tick of ``K_I e`` to the integral (m,), except where it is held."""
    for i in range(error.size):
        is_limited = abs(applied[i]) < HELD_BELOW * abs(last_force[i])
        is_held = is_limited & (last_force[i] * error[i] > 0.0)
        integral[i] += where(is_held, 0.0, k_i[i] * error[i] * period)


@kernel
def add_friction(
    viscous: Array, coulomb: Array, dead_band: Array, desired_rates: Array, force: Array
) -> None:
    """Add the friction of the joints' desired motion to the force (m,); the base has none."""
    for j in range(desired_rates.size):
        i, rate = j + 3, desired_rates[j]
        sense = where(abs(rate) > dead_band[i], np.sign(rate), 0.0)
        force[i] = plus(force[i], viscous[i] * rate + coulomb[i] * sense)


@subroutine
def plus(value: float, term: float) -> float:
    """Return the sum, which has the bits of ``value`` (-0.0, too) if the term is zero."""
    return where(term == 0.0, value, value + term)
