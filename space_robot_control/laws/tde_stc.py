"""Time-delay estimation with super-twisting control (38)-(42), the paper's law."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .base import CompiledLaw

Array = NDArray[np.float64]


@kernel
def time_delay_super_twisting(
    e: Array, edot: Array, rhodd_d: Array, n_hat: Array, h_s: Array, c_s: Array,
    gains: Array, memory: Array, period: float,
) -> None:  # fmt: skip
    """(38), psi of (40) advanced by one tick, (42), (41)."""
    h_bar, lam, k_1, k_2 = gains[0], gains[1], gains[2], gains[3]
    s, u, force, psi = memory[0], memory[1], memory[2], memory[3]
    for i in range(e.size):
        s[i] = edot[i] + lam[i] * e[i]
        psi[i] += k_2[i] * np.sign(s[i]) * period
        u[i] = rhodd_d[i] + lam[i] * edot[i] + k_1[i] * np.sqrt(abs(s[i])) * np.sign(s[i]) + psi[i]
        force[i] = h_bar[i] * u[i] + n_hat[i]


class TimeDelaySuperTwisting(CompiledLaw):
    """``F_S = h_bar u_STC + N_hat``, ``s = edot + lambda e``.

    ``u_STC = rhodd_d + lambda edot + K_1 |s|^1/2 sign(s) + psi``, psi the integral of K_2 sign(s).
    """

    name = "tde_stc"
    gain_descriptions: ClassVar[dict[str, str]] = {
        "h_bar": "constant inertia h_bar of (33), kg m2",
        "lambda": "slope of the sliding surface (38), 1/s",
        "k_1": "K_1 of (40)",
        "k_2": "K_2 of (40), 1/s3",
    }
    memory_rows = 1
    kernel = staticmethod(time_delay_super_twisting)
