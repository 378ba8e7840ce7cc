"""PD control of joints and attitude, without a model: what most spacecraft fly."""

from __future__ import annotations

from space_robot_msgs_py.compiled.kernels import kernel

from .base import Array, CompiledLaw, Signals
from .friction import IntegralMemory, add_error, add_friction, friction_gains, integral_gain, plus
from .gains import LawGains, per_axis


class Gains(LawGains):
    """Stiffness and damping of each axis."""

    k_p: Array = per_axis(
        "stiffness K_P", "N m/rad (eps: N m)", search=(1e-2, 1e5), per_inertia=True
    )
    k_d: Array = per_axis(
        "damping K_D", "N m s/rad (eps: N m s)", search=(0.1, 1e3), per_inertia=True
    )
    k_i = integral_gain("N m/(rad s) (eps: N m/s)", 1e6, per_inertia=True)
    viscous, coulomb, dead_band = friction_gains()


@kernel
def proportional_derivative(
    signals: Signals, gains: Gains, memory: IntegralMemory, period: float
) -> None:
    """Compute one tick: the force; s and u are not used."""
    e, force = signals.error, memory.force
    add_error(e, gains.k_i, signals.applied_force, force, memory.integral, period)
    for i in range(e.size):
        force[i] = gains.k_p[i] * e[i] + gains.k_d[i] * signals.error_rate[i]
        force[i] = plus(force[i], memory.integral[i])
    rates = signals.reference.joint_velocities
    add_friction(gains.viscous, gains.coulomb, gains.dead_band, rates, force)


class ProportionalDerivative(CompiledLaw):
    """``F_S = K_P e + K_D edot`` (Wie, Space Vehicle Dynamics and Control, 7.3, for the base).

    With the gains of `friction`, ``K_I (integral of e)`` and the friction of the desired motion of
    the joints are added.
    """

    name = "pd"
    gains_type, memory_type = Gains, IntegralMemory
    kernel = staticmethod(proportional_derivative)
