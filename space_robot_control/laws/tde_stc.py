"""Time-delay estimation with super-twisting control (38)-(42), the paper's law."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_sim.compiled import kernel

from .base import ControlLaw, Signals

Array = NDArray[np.float64]


class TimeDelaySuperTwisting(ControlLaw):
    """``F_S = Hbar u_STC + N_hat``, ``s = edot + lambda e``.

    ``u_STC = rhodd_d + lambda edot + K_1 |s|^1/2 sign(s) + psi``, psi the integral of K_2 sign(s).
    """

    name = "tde_stc"
    gain_descriptions: ClassVar[dict[str, str]] = {
        "h_bar": "constant inertia Hbar of (33), kg m2",
        "lambda": "slope of the sliding surface (38), 1/s",
        "k_1": "K_1 of (40)",
        "k_2": "K_2 of (40), 1/s3",
    }

    def reset(self) -> None:
        """Empty the integral."""
        self._psi = np.zeros_like(self.sliding_surface)

    def force(self, signals: Signals) -> Array:
        """(41)."""
        time_delay_super_twisting(
            self.gains["h_bar"], self.gains["lambda"], self.gains["k_1"], self.gains["k_2"],
            self.period, signals.error, signals.error_rate, signals.acceleration_desired,
            signals.n_hat, self._psi, self.sliding_surface, self.pseudo_acceleration, self._force,
        )  # fmt: skip
        return self._force


@kernel
def time_delay_super_twisting(
    h_bar: Array, lam: Array, k_1: Array, k_2: Array, period: float, e: Array, edot: Array,
    rhodd_d: Array, n_hat: Array, psi: Array, s: Array, u: Array, force: Array,
) -> None:  # fmt: skip
    """Write (38) into ``s``, advance ``psi`` (40), write (42) into ``u``, (41) into ``force``."""
    for i in range(e.size):
        s[i] = edot[i] + lam[i] * e[i]
        psi[i] += k_2[i] * np.sign(s[i]) * period
        u[i] = rhodd_d[i] + lam[i] * edot[i] + k_1[i] * np.sqrt(abs(s[i])) * np.sign(s[i]) + psi[i]
        force[i] = h_bar[i] * u[i] + n_hat[i]
