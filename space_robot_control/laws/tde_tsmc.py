"""Time-delay estimation with a terminal sliding mode on an integral surface (60)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_sim.compiled import kernel

from .base import ControlLaw, Signals

Array = NDArray[np.float64]


class TimeDelayTerminalSlidingMode(ControlLaw):
    """``F_S = Hbar (u_PD + K_1 |s|^1/2 sign(s)) + N_hat``.

    ``s = integral of (edd + K_D edot + K_P e)`` from when the law is switched on, so s(0) = 0.
    """

    name = "tde_tsmc"
    gain_descriptions: ClassVar[dict[str, str]] = {
        "h_bar": "constant inertia Hbar of (33), kg m2",
        "k_p": "K_P of (31), 1/s2",
        "k_d": "K_D of (31), 1/s",
        "k_1": "reaching gain K_1 of (60)",
    }

    def reset(self) -> None:
        """Start the surface anew."""
        self.sliding_surface[:] = 0.0
        self._last_error_rate = np.full_like(self.sliding_surface, np.nan)

    def force(self, signals: Signals) -> Array:
        """(60)."""
        time_delay_terminal_sliding_mode(
            self.gains["h_bar"], self.gains["k_p"], self.gains["k_d"], self.gains["k_1"],
            self.period, signals.error, signals.error_rate, signals.acceleration_desired,
            signals.n_hat, self._last_error_rate, self.sliding_surface, self.pseudo_acceleration,
            self._force,
        )  # fmt: skip
        return self._force


@kernel
def time_delay_terminal_sliding_mode(
    h_bar: Array, k_p: Array, k_d: Array, k_1: Array, period: float, e: Array, edot: Array,
    rhodd_d: Array, n_hat: Array, last_edot: Array, s: Array, u: Array, force: Array,
) -> None:  # fmt: skip
    """Advance ``s`` by one tick, write the acceleration wanted into ``u``, (60) into ``force``."""
    for i in range(e.size):
        if not np.isnan(last_edot[i]):  # the integral of edd is the change of edot
            s[i] += edot[i] - last_edot[i] + (k_d[i] * edot[i] + k_p[i] * e[i]) * period
        last_edot[i] = edot[i]
        u_pd = rhodd_d[i] + k_d[i] * edot[i] + k_p[i] * e[i]
        u[i] = u_pd + k_1[i] * np.sqrt(abs(s[i])) * np.sign(s[i])
        force[i] = h_bar[i] * u[i] + n_hat[i]
