"""Computed-torque control (30), (31)."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel

from .base import CompiledLaw

Array = NDArray[np.float64]


@kernel
def computed_torque(
    e: Array, edot: Array, rhodd_d: Array, n_hat: Array, h_s: Array, c_s: Array,
    gains: Array, memory: Array, period: float,
) -> None:  # fmt: skip
    """(31), (30)."""
    k_p, k_d = gains[0], gains[1]
    u, force = memory[1], memory[2]
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


class ComputedTorque(CompiledLaw):
    """``F_S = H_S u_PD + c_S``, ``u_PD = rhodd_d + K_D edot + K_P e``."""

    name = "ctc"
    gain_descriptions: ClassVar[dict[str, str]] = {
        "k_p": "K_P of (31), 1/s2",
        "k_d": "K_D of (31), 1/s",
    }
    uses_model = True
    kernel = staticmethod(computed_torque)
