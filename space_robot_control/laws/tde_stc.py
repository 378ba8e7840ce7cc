"""Time-delay estimation with super-twisting control (38)-(42), the paper's law."""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel

from .base import Array, CompiledLaw, LawMemory, Signals
from .gains import LawGains, per_axis


class Gains(LawGains):
    """Gains of (33), (38), (40)."""

    h_bar: Array = per_axis(
        "constant inertia h_bar of (33)", "kg m2", search=(1e-3, 2.0), per_inertia=True
    )
    lambda_: Array = per_axis("slope of the sliding surface (38)", "1/s", search=(0.1, 300.0))
    k_1: Array = per_axis("K_1 of (40)", "s^-3/2", search=(1e-4, 10.0))
    k_2: Array = per_axis("K_2 of (40)", "1/s3", search=(1e-8, 10.0))


class Memory(LawMemory):
    """The integral of (40)."""

    psi: Array = per_axis("integral of K_2 sign(s)", "rad/s2 (eps: 1/s2)")


@kernel
def time_delay_super_twisting(
    signals: Signals, gains: Gains, memory: Memory, period: float
) -> None:
    """Compute one tick: s of (38), psi of (40), u of (42), force of (41)."""
    e, edot, rhodd_d = signals.error, signals.error_rate, signals.acceleration_desired
    lam, k_1, s, u, psi = gains.lambda_, gains.k_1, memory.s, memory.u, memory.psi
    for i in range(e.size):
        # s = edot + lambda e, (38)
        s[i] = edot[i] + lam[i] * e[i]
        # psidot = K_2 sign(s) of (40), whose psi has the other sign; s is held over the tick
        psi[i] += gains.k_2[i] * np.sign(s[i]) * period
        # u_STC of (42)
        u[i] = rhodd_d[i] + lam[i] * edot[i] + k_1[i] * np.sqrt(abs(s[i])) * np.sign(s[i]) + psi[i]
        # F = h_bar u_STC + N_hat, (41)
        memory.force[i] = gains.h_bar[i] * u[i] + signals.n_hat[i]


class TimeDelaySuperTwisting(CompiledLaw):
    """``F_S = h_bar u_STC + N_hat``, ``s = edot + lambda e``.

    ``u_STC = rhodd_d + lambda edot + K_1 |s|^1/2 sign(s) + psi``, psi the integral of K_2 sign(s).
    """

    name = "tde_stc"
    gains_type, memory_type = Gains, Memory
    kernel = staticmethod(time_delay_super_twisting)
