"""Computed torque with a sliding mode in a boundary layer (57), (58)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_sim.compiled import kernel

from .base import ControlLaw, Signals
from .ctc import inverse_dynamics

Array = NDArray[np.float64]


class ComputedTorqueSlidingMode(ControlLaw):
    """``F_S = H_S (rhodd_d + lambda edot) + c_S + g sat(s, Delta)``, ``s = edot + lambda e``."""

    name = "ctc_smc"
    gain_descriptions: ClassVar[dict[str, str]] = {
        "lambda": "slope of the sliding surface (38), 1/s",
        "g": "switching gain of (57), N m",
        "delta": "half-width Delta of the boundary layer (58), rad/s",
    }
    uses_model = True

    def force(self, signals: Signals) -> Array:
        """(57)."""
        computed_torque_sliding_mode(
            self.gains["lambda"], self.gains["g"], self.gains["delta"], signals.error,
            signals.error_rate, signals.acceleration_desired, signals.inertia, signals.bias,
            self.sliding_surface, self.pseudo_acceleration, self._force,
        )  # fmt: skip
        return self._force


@kernel
def computed_torque_sliding_mode(
    lam: Array, g: Array, delta: Array, e: Array, edot: Array, rhodd_d: Array, h_s: Array,
    c_s: Array, s: Array, u: Array, force: Array,
) -> None:  # fmt: skip
    """Write (38) into ``s``, the acceleration wanted into ``u``, (57) into ``force``."""
    for i in range(e.size):
        s[i] = edot[i] + lam[i] * e[i]
        u[i] = rhodd_d[i] + lam[i] * edot[i]
    inverse_dynamics(h_s, c_s, u, force)
    for i in range(e.size):
        force[i] += g[i] * saturation(s[i], delta[i])


@kernel
def saturation(s: float, delta: float) -> float:
    """(58): the sign outside the boundary layer of half-width ``delta``, linear inside."""
    return np.sign(s) if abs(s) > delta else s / delta
