"""Time-delay estimation with a first-order sliding mode (59)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .base import CompiledLaw

Array = NDArray[np.float64]


@kernel
def time_delay_sliding_mode(
    e: Array, edot: Array, rhodd_d: Array, n_hat: Array, h_s: Array, c_s: Array,
    gains: Array, memory: Array, period: float,
) -> None:  # fmt: skip
    """(38), the acceleration wanted, (59)."""
    h_bar, lam, g = gains[0], gains[1], gains[2]
    s, u, force = memory[0], memory[1], memory[2]
    for i in range(e.size):
        s[i] = edot[i] + lam[i] * e[i]
        u[i] = rhodd_d[i] + lam[i] * edot[i]
        force[i] = h_bar[i] * u[i] + n_hat[i] + g[i] * np.sign(s[i])


class TimeDelaySlidingMode(CompiledLaw):
    """``F_S = h_bar (rhodd_d + lambda edot) + N_hat + g sign(s)``, ``s = edot + lambda e``."""

    name = "tde_smc"
    gain_descriptions: ClassVar[dict[str, str]] = {
        "h_bar": "constant inertia h_bar of (33), kg m2",
        "lambda": "slope of the sliding surface (38), 1/s",
        "g": "switching gain of (59), N m",
    }
    kernel = staticmethod(time_delay_sliding_mode)
