"""Time-delay estimation with a terminal sliding mode on an integral surface (60)."""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where

from .base import Array, CompiledLaw, LawMemory, Signals
from .gains import LawGains, per_axis


class Gains(LawGains):
    """Gains of (31), (33), (60)."""

    h_bar: Array = per_axis(
        "constant inertia h_bar of (33)", "kg m2", search=(1e-3, 2.0), per_inertia=True
    )
    k_p: Array = per_axis("K_P of (31)", "1/s2", search=(1e-3, 1e5))
    k_d: Array = per_axis("K_D of (31)", "1/s", search=(1e-2, 1e3))
    k_1: Array = per_axis("reaching gain K_1 of (60)", "s^-3/2", search=(1e-4, 10.0))


class Memory(LawMemory):
    """Internal state of (60), beside the integral s itself."""

    last_edot: Array = per_axis("edot of the last tick; NaN at the first", "rad/s (eps: 1/s)")


@kernel
def time_delay_terminal_sliding_mode(
    signals: Signals, gains: Gains, memory: Memory, period: float
) -> None:
    """Compute one tick: s, u, force of (60)."""
    e, edot, rhodd_d = signals.error, signals.error_rate, signals.acceleration_desired
    k_p, k_d, s, u, last_edot = gains.k_p, gains.k_d, memory.s, memory.u, memory.last_edot
    for i in range(e.size):
        # s = integral of (edd + K_D edot + K_P e), below (60); that of edd is the change of edot
        change = edot[i] - last_edot[i]
        change += (k_d[i] * edot[i] + k_p[i] * e[i]) * period
        s[i] += where(np.isnan(last_edot[i]), 0.0, change)
        last_edot[i] = edot[i]
        # u_PD of (31), and K_1 Lambda(s) sign(s) as in (40)
        u_pd = rhodd_d[i] + k_d[i] * edot[i] + k_p[i] * e[i]
        u[i] = u_pd + gains.k_1[i] * np.sqrt(abs(s[i])) * np.sign(s[i])
        # F = h_bar (u_PD + K_1 Lambda(s) sign(s)) + N_hat, (60)
        memory.force[i] = gains.h_bar[i] * u[i] + signals.n_hat[i]


class TimeDelayTerminalSlidingMode(CompiledLaw):
    """``F_S = h_bar (u_PD + K_1 |s|^1/2 sign(s)) + N_hat``.

    ``s = integral of (edd + K_D edot + K_P e)`` since the law was activated, so s(0) = 0.
    """

    name = "tde_tsmc"
    gains_type, memory_type = Gains, Memory
    kernel = staticmethod(time_delay_terminal_sliding_mode)

    def reset(self) -> None:
        """Restart the integral surface at zero."""
        super().reset()
        self.memory.last_edot[:] = np.nan
