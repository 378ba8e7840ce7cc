"""Computed-torque control (30), (31)."""

from __future__ import annotations

from space_robot_model.dynamics.rho_space import force_for
from space_robot_msgs_py.compiled.kernels import kernel

from .base import Array, CompiledLaw, Signals
from .friction import IntegralMemory, add_error, add_friction, friction_gains, integral_gain, plus
from .gains import LawGains, per_axis


class Gains(LawGains):
    """Gains of (31)."""

    k_p: Array = per_axis("K_P of (31)", "1/s2", search=(1e-2, 1e5))
    k_d: Array = per_axis("K_D of (31)", "1/s", search=(0.1, 1e3))
    k_i = integral_gain("1/s3", 1e6)
    viscous, coulomb, dead_band = friction_gains()


@kernel
def computed_torque(signals: Signals, gains: Gains, memory: IntegralMemory, period: float) -> None:
    """Compute one tick: u of (31), force of (30)."""
    e, edot, rhodd_d = signals.error, signals.error_rate, signals.acceleration_desired
    add_error(e, gains.k_i, signals.applied_force, memory.force, memory.integral, period)
    # u_PD of (31), and the integral
    for i in range(e.size):
        u_pd = rhodd_d[i] + gains.k_d[i] * edot[i] + gains.k_p[i] * e[i]
        memory.u[i] = plus(u_pd, memory.integral[i])
    # F = H_S u_PD + c_S, (30)
    force_for(signals.nominal, memory.u, signals.nominal.bias, memory.force)
    rates = signals.reference.joint_velocities
    add_friction(gains.viscous, gains.coulomb, gains.dead_band, rates, memory.force)


class ComputedTorque(CompiledLaw):
    """``F_S = H_S u_PD + c_S``, ``u_PD = rhodd_d + K_D edot + K_P e``.

    With the gains of `friction` u has ``K_I (integral of e)`` as well, and F_S the friction of the
    desired motion of the joints.
    """

    name = "ctc"
    gains_type, memory_type = Gains, IntegralMemory
    uses_model = True
    kernel = staticmethod(computed_torque)
