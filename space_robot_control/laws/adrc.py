"""Active disturbance rejection control of each axis, linear and with bandwidths as parameters.

Gao, Scaling and bandwidth-parameterization based controller tuning, ACC 2003. An extended state
observer estimates position z_1, rate z_2 and total disturbance z_3 of ``rhodd = z_3 + F_S / J``
from the position alone; the discrete observer is the current estimator of Miklosovic, Radke & Gao,
Discrete implementation and generalization of the extended state observer, ACC 2006, with all three
poles at ``beta = 1 / (1 + omega_o period)``.

That is where a backward difference takes the pole ``-omega_o``, as in `dob`. The lag of z_3, on
which `space-robot gains tune` rests, is then ``3 / omega_o`` as in continuous time, and half a
tick. Errors of the observer fade with ``ln(1 + omega_o period) / period``, the omega_o of the
paper's ``beta = exp(-omega_o period)``: 1595 rad/s for 2440 at 2 kHz.
"""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where

from .base import Array, CompiledLaw, LawMemory, Signals
from .gains import LawGains, per_axis


class Gains(LawGains):
    """Inertia, and bandwidths of controller and observer."""

    inertia: Array = per_axis(
        "inertia J of each axis, 1/b_0", "kg m2", search=(1e-3, 5.0), per_inertia=True
    )
    omega_c: Array = per_axis(
        "bandwidth of the controller: K_P = omega_c^2", "rad/s", search=(1e-2, 300.0)
    )
    omega_o: Array = per_axis(
        "observer: its poles are at 1/(1 + omega_o T), T: tick", "rad/s", search=(1.0, 2e4)
    )


class Memory(LawMemory):
    """State of the observer."""

    z_1: Array = per_axis("estimate of rho; NaN before the first tick", "rad")
    z_2: Array = per_axis("estimate of rhodot", "rad/s (eps: 1/s)")
    z_3: Array = per_axis("estimate of the total disturbance", "rad/s2 (eps: 1/s2)")


@kernel
def disturbance_rejection(signals: Signals, gains: Gains, memory: Memory, period: float) -> None:
    """Compute one tick: z_1 to z_3, u and force; s is not used.

    The first z_3 is the disturbance with which the applied force gives the desired acceleration.
    """
    rho, rate, z_1, z_2, z_3 = signals.rho, signals.rho_rate, memory.z_1, memory.z_2, memory.z_3
    for i in range(rho.size):
        inertia, beta = gains.inertia[i], 1.0 / (1.0 + gains.omega_o[i] * period)
        away, by_force = 1.0 - beta, signals.applied_force[i] / inertia
        is_first = np.isnan(z_1[i])
        acceleration, last_rate = z_3[i] + by_force, z_2[i] + signals.rate_step[i]
        # rhodd = z_3 + F_S / J over the tick, exactly for a constant force
        predicted = (
            z_1[i] + signals.rho_step[i] + period * (last_rate + 0.5 * period * acceleration)
        )
        innovation = rho[i] - predicted
        # gains of the current observer with three poles at beta, Miklosovic et al. 2006
        of_rate = 1.5 * away * away * (1.0 + beta) / period
        of_disturbance = away * away * away / (period * period)
        new_rate = last_rate + period * acceleration + of_rate * innovation
        new_disturbance = z_3[i] + of_disturbance * innovation
        begun = signals.acceleration_desired[i] - by_force
        z_1[i] = where(is_first, rho[i], predicted + (1.0 - beta * beta * beta) * innovation)
        z_2[i] = where(is_first, rate[i], new_rate)
        z_3[i] = where(is_first, begun, new_disturbance)
        # against the observed motion: rho_d - z_1, rhodot_d - z_2
        position_error = signals.error[i] + rho[i] - z_1[i]
        rate_error = signals.error_rate[i] + rate[i] - z_2[i]
        omega_c = gains.omega_c[i]
        memory.u[i] = signals.acceleration_desired[i]
        memory.u[i] += omega_c * (omega_c * position_error + 2.0 * rate_error)
        memory.force[i] = inertia * (memory.u[i] - z_3[i])


class DisturbanceRejection(CompiledLaw):
    """``F_S = J (rhodd_d + omega_c^2 (rho_d - z_1) + 2 omega_c (rhodot_d - z_2) - z_3)``."""

    name = "adrc"
    gains_type, memory_type = Gains, Memory
    kernel = staticmethod(disturbance_rejection)

    def reset(self) -> None:
        """Begin the observer anew at the next tick."""
        super().reset()
        self.memory.z_1[:] = np.nan
