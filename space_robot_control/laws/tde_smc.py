"""Time-delay estimation with a first-order sliding mode (59)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_sim.compiled import kernel

from .base import ControlLaw, Signals

Array = NDArray[np.float64]


class TimeDelaySlidingMode(ControlLaw):
    """``F_S = Hbar (rhodd_d + lambda edot) + N_hat + g sign(s)``, ``s = edot + lambda e``."""

    name = "tde_smc"
    gain_descriptions: ClassVar[dict[str, str]] = {
        "h_bar": "constant inertia Hbar of (33), kg m2",
        "lambda": "slope of the sliding surface (38), 1/s",
        "g": "switching gain of (59), N m",
    }

    def force(self, signals: Signals) -> Array:
        """(59)."""
        time_delay_sliding_mode(
            self.gains["h_bar"], self.gains["lambda"], self.gains["g"], signals.error,
            signals.error_rate, signals.acceleration_desired, signals.n_hat,
            self.sliding_surface, self.pseudo_acceleration, self._force,
        )  # fmt: skip
        return self._force


@kernel
def time_delay_sliding_mode(
    h_bar: Array, lam: Array, g: Array, e: Array, edot: Array, rhodd_d: Array, n_hat: Array,
    s: Array, u: Array, force: Array,
) -> None:  # fmt: skip
    """Write (38) into ``s``, the acceleration wanted into ``u``, (59) into ``force``."""
    for i in range(e.size):
        s[i] = edot[i] + lam[i] * e[i]
        u[i] = rhodd_d[i] + lam[i] * edot[i]
        force[i] = h_bar[i] * u[i] + n_hat[i] + g[i] * np.sign(s[i])
