"""Incremental nonlinear dynamic inversion: time-delay estimation with the nominal inertia.

Sieberling, Chu & Mulder, J. Guidance 33(6), 2010; Smeur, Chu & de Croon, J. Guidance 39(3), 2016.
The increment of the force is the nominal inertia times the acceleration that is missing,
``F_S = F_S(t - d) + H_S (u - rhodd(t - d))``, so c_S need not be known.
"""

from __future__ import annotations

from space_robot_model.dynamics.rho_space import force_for
from space_robot_msgs_py.compiled.kernels import kernel

from .base import Array, CompiledLaw, LawMemory, Signals
from .gains import LawGains, per_axis


class Gains(LawGains):
    """Gains of (31)."""

    k_p: Array = per_axis("K_P of (31)", "1/s2", search=(1e-3, 1e5))
    k_d: Array = per_axis("K_D of (31)", "1/s", search=(1e-2, 1e3))


@kernel
def incremental_inversion(signals: Signals, gains: Gains, memory: LawMemory, period: float) -> None:
    """Compute one tick: u of (31), force of (37) with H_S in place of h_bar."""
    e, edot, rhodd_d = signals.error, signals.error_rate, signals.acceleration_desired
    # u_PD of (31)
    for i in range(e.size):
        memory.u[i] = rhodd_d[i] + gains.k_d[i] * edot[i] + gains.k_p[i] * e[i]
    # F = H_S u_PD + N_hat, (37) with H_S
    force_for(signals.nominal, memory.u, signals.n_hat, memory.force)


class IncrementalInversion(CompiledLaw):
    """``F_S = H_S u_PD + N_hat``, ``N_hat = F_S(t - d) - H_S rhodd(t - d)``, u_PD of (31)."""

    name = "indi"
    gains_type = Gains
    estimates_with_model = True
    kernel = staticmethod(incremental_inversion)
