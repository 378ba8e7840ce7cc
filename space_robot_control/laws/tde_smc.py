"""Time-delay estimation with a first-order sliding mode (59)."""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel

from .base import Array, CompiledLaw, LawMemory, Signals
from .gains import LawGains, per_axis


class Gains(LawGains):
    """Gains of (33), (38), (59)."""

    h_bar: Array = per_axis(
        "constant inertia h_bar of (33)", "kg m2", search=(1e-3, 2.0), per_inertia=True
    )
    lambda_: Array = per_axis("slope of the sliding surface (38)", "1/s", search=(0.1, 300.0))
    g: Array = per_axis("switching gain of (59)", "N m", search=(1e-6, 10.0), per_inertia=True)


@kernel
def time_delay_sliding_mode(
    signals: Signals, gains: Gains, memory: LawMemory, period: float
) -> None:
    """Compute one tick: s of (38), u, force of (59)."""
    e, edot, rhodd_d = signals.error, signals.error_rate, signals.acceleration_desired
    h_bar, lam, s, u = gains.h_bar, gains.lambda_, memory.s, memory.u
    for i in range(e.size):
        # s = edot + lambda e, (38)
        s[i] = edot[i] + lam[i] * e[i]
        u[i] = rhodd_d[i] + lam[i] * edot[i]
        # F = h_bar u + N_hat + g sign(s), (59)
        memory.force[i] = h_bar[i] * u[i] + signals.n_hat[i] + gains.g[i] * np.sign(s[i])


class TimeDelaySlidingMode(CompiledLaw):
    """``F_S = h_bar (rhodd_d + lambda edot) + N_hat + g sign(s)``, ``s = edot + lambda e``."""

    name = "tde_smc"
    gains_type = Gains
    kernel = staticmethod(time_delay_sliding_mode)
