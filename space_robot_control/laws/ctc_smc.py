"""Computed torque with a sliding mode in a boundary layer (57), (58)."""

from __future__ import annotations

import numpy as np

from space_robot_model.dynamics.rho_space import force_for
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where

from .base import Array, CompiledLaw, Signals
from .friction import IntegralMemory, add_error, add_friction, friction_gains, integral_gain, plus
from .gains import LawGains, per_axis


class Gains(LawGains):
    """Gains of (38), (57), (58)."""

    lambda_: Array = per_axis("slope of the sliding surface (38)", "1/s", search=(0.1, 300.0))
    g: Array = per_axis("switching gain of (57)", "N m", search=(1e-4, 1e3), per_inertia=True)
    delta: Array = per_axis(
        "half-width Delta of the boundary layer (58)", "rad/s", search=(1e-8, 1.0)
    )
    k_i = integral_gain("1/s2", 1e4)
    viscous, coulomb, dead_band = friction_gains()


@kernel
def computed_torque_sliding_mode(
    signals: Signals, gains: Gains, memory: IntegralMemory, period: float
) -> None:
    """Compute one tick: s of (38), u, force of (57)."""
    e, edot, rhodd_d = signals.error, signals.error_rate, signals.acceleration_desired
    lam, s, u, force = gains.lambda_, memory.s, memory.u, memory.force
    add_error(e, gains.k_i, signals.applied_force, force, memory.integral, period)
    for i in range(e.size):
        # s = edot + lambda e, (38), and the integral
        s[i] = plus(edot[i] + lam[i] * e[i], memory.integral[i])
        u[i] = plus(rhodd_d[i] + lam[i] * edot[i], gains.k_i[i] * e[i])
    # F = H_S u + c_S + g sat(s, Delta), (57)
    force_for(signals.nominal, u, signals.nominal.bias, force)
    for i in range(e.size):
        force[i] += gains.g[i] * saturation(s[i], gains.delta[i])
    rates = signals.reference.joint_velocities
    add_friction(gains.viscous, gains.coulomb, gains.dead_band, rates, force)


@kernel
def saturation(s: float, delta: float) -> float:
    """Return (58): the sign outside the boundary layer of half-width ``delta``, linear inside."""
    sign: float = np.sign(s)
    return where(abs(s) > delta, sign, s / delta)


class ComputedTorqueSlidingMode(CompiledLaw):
    """``F_S = H_S (rhodd_d + lambda edot) + c_S + g sat(s, Delta)``, ``s = edot + lambda e``.

    With the gains of `friction` s has ``K_I (integral of e)`` as well, u the rate of this, and F_S
    the friction of the desired motion of the joints.
    """

    name = "ctc_smc"
    gains_type, memory_type = Gains, IntegralMemory
    uses_model = True
    kernel = staticmethod(computed_torque_sliding_mode)
