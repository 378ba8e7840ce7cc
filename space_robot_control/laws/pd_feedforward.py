"""PD control with the torque on the base that cancels the motion of the joints.

The joints' torques are those of PD control. The nominal model says which accelerations of the
joints they cause, and which torque on the base lets it follow its reference meanwhile; PD control
of the attitude is added. For a base at rest this is the compensation of Carignan & Akin, The
reaction stabilization of on-orbit robots, IEEE Control Systems Magazine 20(6), 2000, in which the
joints' torques are known, and of Basilisk's ``jointMotionCompensator``.
"""

from __future__ import annotations

from space_robot_model.elementary.linear_algebra import cholesky_into, solve_cholesky
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import shaped

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


class Memory(IntegralMemory):
    """The integral, and scratch of the forward dynamics of the joints."""

    factor: Array = shaped(lambda n: (n, n), "Cholesky factor of H_qq")


@kernel
def feedforward(signals: Signals, gains: Gains, memory: Memory, period: float) -> None:
    """Compute one tick: u, the predicted acceleration, and the force; s is not used.

    H_S and c_S have blocks b (base) and q (joints).
    """
    inertia, bias = signals.nominal.inertia, signals.nominal.bias
    e, u, force, axes = signals.error, memory.u, memory.force, signals.error.size
    add_error(e, gains.k_i, signals.applied_force, force, memory.integral, period)
    for i in range(axes):
        force[i] = gains.k_p[i] * e[i] + gains.k_d[i] * signals.error_rate[i]
        force[i] = plus(force[i], memory.integral[i])
    # u_b = rhodd_d,b
    for k in range(3):
        u[k] = signals.acceleration_desired[k]
    # H_qq u_q = F_q - c_q - H_qb u_b
    for i in range(3, axes):
        u[i] = force[i] - bias[i]
        for k in range(3):
            u[i] -= inertia[i, k] * u[k]
    cholesky_into(inertia, 3, memory.factor)
    solve_cholesky(memory.factor, u[3:])
    # F_b += H_bb u_b + H_bq u_q + c_b
    for k in range(3):
        force[k] += bias[k]
        for j in range(axes):
            force[k] += inertia[k, j] * u[j]
    # what friction takes accelerates nothing
    rates = signals.reference.joint_velocities
    add_friction(gains.viscous, gains.coulomb, gains.dead_band, rates, force)


class ProportionalDerivativeFeedforward(CompiledLaw):
    """``F_q = K_P e + K_D edot``; the base has, beside the same, its part of ``H_S u + c_S``.

    u is the acceleration that F_q causes while the base follows its reference. With the gains of
    `friction` there is ``K_I (integral of e)`` beside K_P e; the friction of the desired motion is
    added to F_q, and causes no acceleration.
    """

    name = "pd_feedforward"
    gains_type, memory_type = Gains, Memory
    uses_model = True
    kernel = staticmethod(feedforward)
