"""Computed torque with a sliding mode in a boundary layer (57), (58)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .base import CompiledLaw
from .ctc import inverse_dynamics

Array = NDArray[np.float64]


@kernel
def computed_torque_sliding_mode(
    e: Array, edot: Array, rhodd_d: Array, n_hat: Array, h_s: Array, c_s: Array,
    gains: Array, memory: Array, period: float,
) -> None:  # fmt: skip
    """(38), the acceleration wanted, (57)."""
    lam, g, delta = gains[0], gains[1], gains[2]
    s, u, force = memory[0], memory[1], memory[2]
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


class ComputedTorqueSlidingMode(CompiledLaw):
    """``F_S = H_S (rhodd_d + lambda edot) + c_S + g sat(s, Delta)``, ``s = edot + lambda e``."""

    name = "ctc_smc"
    gain_descriptions: ClassVar[dict[str, str]] = {
        "lambda": "slope of the sliding surface (38), 1/s",
        "g": "switching gain of (57), N m",
        "delta": "half-width Delta of the boundary layer (58), rad/s",
    }
    uses_model = True
    kernel = staticmethod(computed_torque_sliding_mode)
