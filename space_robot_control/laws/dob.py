"""Disturbance observer of each axis, with PD control.

Nakao, Ohnishi & Miyachi, A robust decentralized joint control based on interference estimation,
ICRA 1987; Ohnishi, Shibata & Murakami, Motion control for advanced mechatronics, IEEE/ASME Trans.
Mechatronics 1(1), 1996. Everything that the inertia J of an axis does not explain is a disturbance,
observed through a low-pass without differentiating the rate:

    d_hat = g / (s + g) (F_S + g J rhodot) - g J rhodot.

With backward differences this is the time-delay estimate behind a low-pass whose pole is
``1 / (1 + g period)``: its lag is 1 / g, and it fades with ``ln(1 + g period) / period``.
"""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where

from .base import Array, CompiledLaw, LawMemory, Signals
from .gains import LawGains, per_axis


class Gains(LawGains):
    """Gains of (31), inertia and g of the observer."""

    inertia: Array = per_axis(
        "nominal inertia J of each axis", "kg m2", search=(1e-3, 2.0), per_inertia=True
    )
    bandwidth: Array = per_axis(
        "g of the observer: its pole is at 1/(1 + g T), T: tick", "rad/s", search=(1.0, 2e4)
    )
    k_p: Array = per_axis("K_P of (31)", "1/s2", search=(1e-3, 1e5))
    k_d: Array = per_axis("K_D of (31)", "1/s", search=(1e-2, 1e3))


class Memory(LawMemory):
    """State of the low-pass."""

    smooth: Array = per_axis("low-pass of F_S + g J rhodot; NaN before the first tick", "N m")
    last_rate: Array = per_axis("rhodot of the last tick", "rad/s (eps: 1/s)")


@kernel
def disturbance_observer(signals: Signals, gains: Gains, memory: Memory, period: float) -> None:
    """Compute one tick: d_hat, u of (31) and force; s is not used.

    The first d_hat is the applied force that the desired acceleration does not explain.
    """
    e, edot, rhodd_d = signals.error, signals.error_rate, signals.acceleration_desired
    force, rate, smooth = signals.applied_force, signals.rho_rate, memory.smooth
    for i in range(e.size):
        inertia = gains.inertia[i]
        # g / (s + g) by backward differences; ``momentum`` is g J of the discrete observer
        share = gains.bandwidth[i] * period / (1.0 + gains.bandwidth[i] * period)
        momentum = share / period * inertia
        # the reference's step moves rhodot without a force
        last_rate = memory.last_rate[i] + signals.rate_step[i]
        begun = force[i] - inertia * rhodd_d[i] + momentum * rate[i]
        passed = smooth[i] + share * (force[i] + momentum * last_rate - smooth[i])
        smooth[i] = where(np.isnan(smooth[i]), begun, passed)
        memory.last_rate[i] = rate[i]
        disturbance = smooth[i] - momentum * rate[i]
        # u_PD of (31)
        memory.u[i] = rhodd_d[i] + gains.k_d[i] * edot[i] + gains.k_p[i] * e[i]
        memory.force[i] = inertia * memory.u[i] + disturbance


class DisturbanceObserver(CompiledLaw):
    """``F_S = J u_PD + d_hat``, ``d_hat = g / (s + g) (F_S + g J rhodot) - g J rhodot``."""

    name = "dob"
    gains_type, memory_type = Gains, Memory
    kernel = staticmethod(disturbance_observer)

    def reset(self) -> None:
        """Begin the observer anew at the next tick."""
        super().reset()
        self.memory.smooth[:] = np.nan
