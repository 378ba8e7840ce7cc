"""Computed-torque control (30), (31)."""

from __future__ import annotations

from space_robot_model.dynamics.rho_space import force_for
from space_robot_msgs_py.compiled.kernels import kernel

from .base import Array, CompiledLaw, LawGains, LawMemory, Signals, per_axis


class Gains(LawGains):
    """Gains of (31)."""

    k_p: Array = per_axis("K_P of (31)", "1/s2")
    k_d: Array = per_axis("K_D of (31)", "1/s")


@kernel
def computed_torque(signals: Signals, gains: Gains, memory: LawMemory, period: float) -> None:
    """Compute one tick: u of (31), force of (30)."""
    e, edot, rhodd_d = signals.error, signals.error_rate, signals.acceleration_desired
    # u_PD of (31)
    for i in range(e.size):
        memory.u[i] = rhodd_d[i] + gains.k_d[i] * edot[i] + gains.k_p[i] * e[i]
    # F = H_S u_PD + c_S, (30)
    force_for(signals.nominal, memory.u, signals.nominal.bias, memory.force)


class ComputedTorque(CompiledLaw):
    """``F_S = H_S u_PD + c_S``, ``u_PD = rhodd_d + K_D edot + K_P e``."""

    name = "ctc"
    gains_type = Gains
    uses_model = True
    kernel = staticmethod(computed_torque)
