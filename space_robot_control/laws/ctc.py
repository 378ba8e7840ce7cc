"""Computed-torque control (30), (31)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_sim.compiled import kernel

from .base import ControlLaw, Signals

Array = NDArray[np.float64]


class ComputedTorque(ControlLaw):
    """``F_S = H_S u_PD + c_S``, ``u_PD = rhodd_d + K_D edot + K_P e``."""

    name = "ctc"
    gain_descriptions: ClassVar[dict[str, str]] = {
        "k_p": "K_P of (31), 1/s2",
        "k_d": "K_D of (31), 1/s",
    }
    uses_model = True

    def force(self, signals: Signals) -> Array:
        """(30)."""
        computed_torque(
            self.gains["k_p"], self.gains["k_d"], signals.error, signals.error_rate,
            signals.acceleration_desired, signals.inertia, signals.bias,
            self.pseudo_acceleration, self._force,
        )  # fmt: skip
        return self._force


@kernel
def computed_torque(
    k_p: Array, k_d: Array, e: Array, edot: Array, rhodd_d: Array, h_s: Array, c_s: Array,
    u: Array, force: Array,
) -> None:  # fmt: skip
    """Write (31) into ``u`` and (30) into ``force``."""
    for i in range(e.size):
        u[i] = rhodd_d[i] + k_d[i] * edot[i] + k_p[i] * e[i]
    inverse_dynamics(h_s, c_s, u, force)


@kernel
def inverse_dynamics(h_s: Array, c_s: Array, u: Array, force: Array) -> None:
    """``force = H_S u + c_S``."""
    for i in range(u.size):
        force[i] = c_s[i]
        for j in range(u.size):
            force[i] += h_s[i, j] * u[j]
