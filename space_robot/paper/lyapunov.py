"""The conditions of Appendix B on one axis: circle criterion (73) and LMI (51).

The circle criterion: ``G(j omega)`` (74) must stay within the circle of radius 1 / beta. The text
under (71) says radius beta; (73) is correct. The second case of (77) is misprinted (its terms have
different units); the one here follows from (75) and (76).

The LMI has a Lyapunov function ``V = eta^T M eta`` (47) with decay rate gamma. (51) requires M > 0
and gamma > 0 with

    [ A^T M + M A + gamma M + beta^2 C^T C   M B ]
    [ B^T M                                   -1 ]  <=  0.

With ``A_gamma = A + gamma/2 E`` the upper left block is that of the bounded real lemma: M exists
if and only if A_gamma is stable and ``max |C (j omega E - A_gamma)^-1 B| <= 1 / beta``. That
transfer function is G(s - gamma/2), again ``1 / (2 s^2 + k_1 s + k_2)`` with

    k_1 = K_1 - 2 gamma,    k_2 = K_2 - K_1 gamma / 2 + gamma^2 / 2,

so its peak is known in closed form, and the largest gamma is the root of one scalar equation.

The paper's M, (48), does not satisfy (51) for the paper's gains: its Schur complement has
``-K_1/2 + gamma + 1`` in the corner, positive unless ``K_1 >= 2 (1 + gamma)``. Only the scale of M
is wrong, since -1 and beta^2 are fixed: a small enough multiple of (48) satisfies (51).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_are
from scipy.optimize import brentq

from space_robot_model.elementary.matrices import Array

ComplexArray = NDArray[np.complex128]

B = np.array([[0.0], [1.0]])
C = np.array([[1.0, 0.0]])

MARGIN = 1e-3
"""Relative reduction of the largest gamma, so that (51) holds despite rounding."""


def transfer_function(k_1: float, k_2: float, omega: Array) -> ComplexArray:
    """(74): ``G(j omega) = 1 / (2 s^2 + K_1 s + K_2)``, at ``omega`` in rad/s; s3/rad."""
    s = 1j * omega
    return np.asarray(1.0 / (2.0 * s**2 + k_1 * s + k_2))


def peak_gain(k_1: float, k_2: float) -> float:
    """(77), corrected: ``max |G(j omega)|``, infinite if G is not asymptotically stable.

    Its square is ``1 / K_2^2`` at omega = 0 if ``K_1^2 >= 4 K_2``, else
    ``16 / (8 K_2 K_1^2 - K_1^4)`` at ``omega^2 = K_2 / 2 - K_1^2 / 8``.
    """
    tolerated = largest_tolerated_beta(k_1, k_2)
    return 1.0 / tolerated if tolerated > 0.0 else np.inf


def largest_tolerated_beta(k_1: float, k_2: float) -> float:
    """Return the largest beta for (73), ``1 / max |G|``, which is K_2 if ``K_1^2 >= 4 K_2``."""
    if k_1 <= 0.0 or k_2 <= 0.0:
        return 0.0
    if k_1**2 >= 4.0 * k_2:
        return k_2
    return k_1 / 4.0 * float(np.sqrt(8.0 * k_2 - k_1**2))


@dataclass(frozen=True)
class Certificate:
    """A solution of (51) for one axis."""

    beta: float
    gamma: float
    """Decay rate in ``Vdot <= -gamma V / |eta_1|``; unit of K_1."""
    m: Array
    """(2, 2) M."""
    m_eigenvalues: Array
    """(2,) eigenvalues of M, ascending."""
    residual: float
    """Largest eigenvalue of the left side of (51)."""

    def value(self, eta: Array) -> Array:
        """(47): V of ``eta`` (..., 2)."""
        return np.asarray(np.einsum("...i,ij,...j->...", eta, self.m, eta))

    @property
    def decay(self) -> float:
        """``Psi = gamma lambda_min(M)^1/2``: ``Vdot <= -Psi V^1/2`` (54)."""
        return self.gamma * float(np.sqrt(self.m_eigenvalues[0]))

    def reaching_time(self, initial_value: float) -> float:
        """(56): bound of the time, s, until V decays from ``initial_value`` to zero."""
        return 2.0 * float(np.sqrt(initial_value)) / self.decay

    def bound(self, initial_value: float, time: Array) -> Array:
        """(55): upper bound (K,) of V at ``time`` (K,), s, for ``initial_value`` at time 0."""
        root = np.sqrt(initial_value) - 0.5 * self.decay * time
        return np.asarray(np.maximum(root, 0.0) ** 2)


def state_matrix(k_1: float, k_2: float) -> Array:
    """Return A (2, 2) of (50)."""
    return np.array([[-0.5 * k_1, 0.5], [-k_2, 0.0]])


def paper_m(k_1: float, k_2: float) -> Array:
    """Return M (2, 2) of (48)."""
    return 0.5 * np.array([[k_1**2 + 4.0 * k_2, -k_1], [-k_1, 2.0]])


def residual(m: Array, k_1: float, k_2: float, beta: float, gamma: float) -> float:
    """Return the largest eigenvalue of the left side of (51); at most 0 if the LMI holds."""
    a = state_matrix(k_1, k_2)
    corner = a.T @ m + m @ a + gamma * m + beta**2 * C.T @ C
    return float(np.linalg.eigvalsh(np.block([[corner, m @ B], [B.T @ m, -np.eye(1)]]))[-1])


def shifted_gains(k_1: float, k_2: float, gamma: float) -> tuple[float, float]:
    """Return ``k_1, k_2`` of ``G(s - gamma/2)``."""
    return k_1 - 2.0 * gamma, k_2 - 0.5 * k_1 * gamma + 0.5 * gamma**2


def largest_gamma(k_1: float, k_2: float, beta: float) -> float | None:
    """Return the largest gamma for which (51) has a solution M; None if there is none above 0."""
    if beta >= largest_tolerated_beta(k_1, k_2):
        return None
    # stability limit of A_gamma: twice the slowest decay rate of A
    damping = k_1**2 - 8.0 * k_2
    end = 4.0 * k_2 / (k_1 + np.sqrt(damping)) if damping > 0.0 else 0.5 * k_1

    def reserve(gamma: float) -> float:
        return largest_tolerated_beta(*shifted_gains(k_1, k_2, gamma)) - beta

    if reserve(end) >= 0.0:  # beta = 0: only stability is required
        return float(end)
    return float(brentq(reserve, 0.0, end, xtol=1e-14 * end))


def lyapunov_matrix(k_1: float, k_2: float, beta: float, gamma: float) -> Array:
    """Return M (2, 2) for which (51) holds with equality, from its Riccati equation.

    The equation is scaled, because the paper's gains span four decades: ``eta_2`` in units of
    K_1 eta_1, time in 2 / K_1 and V in 2 beta^2 / K_1. Only ``2 K_2 / K_1^2`` and
    ``2 beta / K_1^2`` remain.
    """
    kappa, disturbance = 2.0 * k_2 / k_1**2, 2.0 * beta / k_1**2
    a = np.array([[-1.0, 1.0], [-kappa, 0.0]]) + gamma / k_1 * np.eye(2)
    scaled = solve_continuous_are(a, disturbance * B, C.T @ C, -np.eye(1))
    units = np.array([1.0, 1.0 / k_1])
    return np.asarray(2.0 * beta**2 / k_1 * np.outer(units, units) * scaled)


def certify(k_1: float, k_2: float, beta: float) -> Certificate | None:
    """Solve (51) for a ``beta`` above 0 with nearly the largest gamma; None if infeasible."""
    largest = largest_gamma(k_1, k_2, beta)
    if largest is None or beta <= 0.0:
        return None
    gamma = (1.0 - MARGIN) * largest
    m = lyapunov_matrix(k_1, k_2, beta, 0.5 * (gamma + largest))
    left = residual(m, k_1, k_2, beta, gamma)
    eigenvalues = np.asarray(np.linalg.eigvalsh(m), dtype=np.float64)
    return Certificate(beta, gamma, m, eigenvalues, left)
