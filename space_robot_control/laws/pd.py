"""PD control of joints and attitude, without a model: what most spacecraft fly."""

from __future__ import annotations

from space_robot_msgs_py.compiled.kernels import kernel

from .base import Array, CompiledLaw, LawGains, LawMemory, Signals, per_axis


class Gains(LawGains):
    """Stiffness and damping of each axis."""

    k_p: Array = per_axis("stiffness K_P", "N m/rad (eps: N m)")
    k_d: Array = per_axis("damping K_D", "N m s/rad (eps: N m s)")


@kernel
def proportional_derivative(
    signals: Signals, gains: Gains, memory: LawMemory, period: float
) -> None:
    """Compute one tick: the force; s and u are not used."""
    for i in range(signals.error.size):
        memory.force[i] = gains.k_p[i] * signals.error[i] + gains.k_d[i] * signals.error_rate[i]


class ProportionalDerivative(CompiledLaw):
    """``F_S = K_P e + K_D edot`` (Wie, Space Vehicle Dynamics and Control, 7.3, for the base)."""

    name = "pd"
    gains_type = Gains
    kernel = staticmethod(proportional_derivative)
