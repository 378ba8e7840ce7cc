"""Time-delay estimation with a terminal sliding mode on an integral surface (60)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .base import CompiledLaw

Array = NDArray[np.float64]


@kernel
def time_delay_terminal_sliding_mode(
    e: Array, edot: Array, rhodd_d: Array, n_hat: Array, h_s: Array, c_s: Array,
    gains: Array, memory: Array, period: float,
) -> None:  # fmt: skip
    """Advance ``s`` by one tick, the acceleration wanted, (60)."""
    h_bar, k_p, k_d, k_1 = gains[0], gains[1], gains[2], gains[3]
    s, u, force, last_edot = memory[0], memory[1], memory[2], memory[3]
    for i in range(e.size):
        if not np.isnan(last_edot[i]):  # the integral of edd is the change of edot
            s[i] += edot[i] - last_edot[i] + (k_d[i] * edot[i] + k_p[i] * e[i]) * period
        last_edot[i] = edot[i]
        u_pd = rhodd_d[i] + k_d[i] * edot[i] + k_p[i] * e[i]
        u[i] = u_pd + k_1[i] * np.sqrt(abs(s[i])) * np.sign(s[i])
        force[i] = h_bar[i] * u[i] + n_hat[i]


class TimeDelayTerminalSlidingMode(CompiledLaw):
    """``F_S = h_bar (u_PD + K_1 |s|^1/2 sign(s)) + N_hat``.

    ``s = integral of (edd + K_D edot + K_P e)`` from when the law is switched on, so s(0) = 0.
    """

    name = "tde_tsmc"
    gain_descriptions: ClassVar[dict[str, str]] = {
        "h_bar": "constant inertia h_bar of (33), kg m2",
        "k_p": "K_P of (31), 1/s2",
        "k_d": "K_D of (31), 1/s",
        "k_1": "reaching gain K_1 of (60)",
    }
    memory_rows = 1
    kernel = staticmethod(time_delay_terminal_sliding_mode)

    def reset(self) -> None:
        """Start the surface anew."""
        super().reset()
        self.memory[3] = np.nan
