"""Computed torque with a sliding mode in a boundary layer (57), (58)."""

from __future__ import annotations

import numpy as np

from space_robot_model.dynamics.rho_space import force_for
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where

from .base import Array, CompiledLaw, LawGains, LawMemory, Signals, per_axis


class Gains(LawGains):
    """Gains of (38), (57), (58)."""

    lambda_: Array = per_axis("slope of the sliding surface (38)", "1/s")
    g: Array = per_axis("switching gain of (57)", "N m")
    delta: Array = per_axis("half-width Delta of the boundary layer (58)", "rad/s")


@kernel
def computed_torque_sliding_mode(
    signals: Signals, gains: Gains, memory: LawMemory, period: float
) -> None:
    """Compute one tick: s of (38), u, force of (57)."""
    e, edot, rhodd_d = signals.error, signals.error_rate, signals.acceleration_desired
    lam, s, u, force = gains.lambda_, memory.s, memory.u, memory.force
    for i in range(e.size):
        # s = edot + lambda e, (38)
        s[i] = edot[i] + lam[i] * e[i]
        u[i] = rhodd_d[i] + lam[i] * edot[i]
    # F = H_S u + c_S + g sat(s, Delta), (57)
    force_for(signals.nominal, u, signals.nominal.bias, force)
    for i in range(e.size):
        force[i] += gains.g[i] * saturation(s[i], gains.delta[i])


@kernel
def saturation(s: float, delta: float) -> float:
    """Return (58): the sign outside the boundary layer of half-width ``delta``, linear inside."""
    sign: float = np.sign(s)
    return where(abs(s) > delta, sign, s / delta)


class ComputedTorqueSlidingMode(CompiledLaw):
    """``F_S = H_S (rhodd_d + lambda edot) + c_S + g sat(s, Delta)``, ``s = edot + lambda e``."""

    name = "ctc_smc"
    gains_type = Gains
    uses_model = True
    kernel = staticmethod(computed_torque_sliding_mode)
