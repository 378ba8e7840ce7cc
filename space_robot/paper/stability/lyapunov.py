"""The LMI (51): a Lyapunov function ``V = eta^T M eta`` (47) that falls at the rate gamma.

(51) asks for M > 0 and gamma > 0 with

    [ A^T M + M A + gamma M + beta^2 C^T C   M B ]
    [ B^T M                                   -1 ]  <=  0.

With ``A_gamma = A + gamma/2 E`` the upper left block is that of the bounded real lemma: M exists
if and only if A_gamma is stable and ``max |C (j omega E - A_gamma)^-1 B| <= 1 / beta``. That
transfer function is G(s - gamma/2), again ``1 / (2 s^2 + k_1 s + k_2)`` with

    k_1 = K_1 - 2 gamma,    k_2 = K_2 - K_1 gamma / 2 + gamma^2 / 2,

so its peak is known in closed form, and the largest gamma is the root of one scalar equation.

The M that the paper prints, (48), does not satisfy (51) at the size of its gains: its Schur
complement has ``-K_1/2 + gamma + 1`` in the corner, positive unless ``K_1 >= 2 (1 + gamma)``. The
fault is one of scale, which the -1 and the beta^2 fix: a small enough multiple of (48) does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_continuous_are
from scipy.optimize import brentq

from .circle_criterion import largest_tolerated_beta

Array = NDArray[np.float64]

B = np.array([[0.0], [1.0]])
C = np.array([[1.0, 0.0]])

MARGIN = 1e-3
"""Share of the largest gamma given away, so that (51) holds with room for rounding."""


@dataclass(frozen=True)
class Certificate:
    """A solution of (51) for one axis."""

    beta: float
    gamma: float
    """``Vdot <= -gamma V / |eta_1|``; in the unit of K_1."""
    m: Array
    """(2, 2) M."""
    m_eigenvalues: Array
    """(2,) of M, rising."""
    residual: float
    """Largest eigenvalue of the block matrix of (51)."""

    def value(self, eta: Array) -> Array:
        """(47): V of ``eta`` (..., 2)."""
        return np.asarray(np.einsum("...i,ij,...j->...", eta, self.m, eta))

    @property
    def decay(self) -> float:
        """``Psi = gamma lambda_min(M)^1/2``: ``Vdot <= -Psi V^1/2`` (54)."""
        return self.gamma * float(np.sqrt(self.m_eigenvalues[0]))

    def reaching_time(self, initial_value: float) -> float:
        """(56): s after which V is zero, from ``initial_value`` of V."""
        return 2.0 * float(np.sqrt(initial_value)) / self.decay

    def bound(self, initial_value: float, time: Array) -> Array:
        """(55): what V cannot exceed at ``time`` (K,) s, from ``initial_value`` on."""
        root = np.sqrt(initial_value) - 0.5 * self.decay * time
        return np.asarray(np.maximum(root, 0.0) ** 2)


def state_matrix(k_1: float, k_2: float) -> Array:
    """A of (50)."""
    return np.array([[-0.5 * k_1, 0.5], [-k_2, 0.0]])


def paper_m(k_1: float, k_2: float) -> Array:
    """M of (48)."""
    return 0.5 * np.array([[k_1**2 + 4.0 * k_2, -k_1], [-k_1, 2.0]])


def block_matrix(m: Array, k_1: float, k_2: float, beta: float, gamma: float) -> Array:
    """(3, 3) left side of (51)."""
    a = state_matrix(k_1, k_2)
    corner = a.T @ m + m @ a + gamma * m + beta**2 * C.T @ C
    return np.block([[corner, m @ B], [B.T @ m, -np.eye(1)]])


def residual(m: Array, k_1: float, k_2: float, beta: float, gamma: float) -> float:
    """Largest eigenvalue of the left side of (51); the LMI holds if it is not above 0."""
    return float(np.linalg.eigvalsh(block_matrix(m, k_1, k_2, beta, gamma))[-1])


def shifted_gains(k_1: float, k_2: float, gamma: float) -> tuple[float, float]:
    """``k_1, k_2`` of ``G(s - gamma/2)``."""
    return k_1 - 2.0 * gamma, k_2 - 0.5 * k_1 * gamma + 0.5 * gamma**2


def largest_gamma(k_1: float, k_2: float, beta: float) -> float | None:
    """Return the largest gamma for which (51) has a solution M; None: there is none above 0."""
    if beta >= largest_tolerated_beta(k_1, k_2):
        return None
    # where A_gamma stops being stable: twice the slowest decay of A
    damping = k_1**2 - 8.0 * k_2
    end = 4.0 * k_2 / (k_1 + np.sqrt(damping)) if damping > 0.0 else 0.5 * k_1

    def reserve(gamma: float) -> float:
        return largest_tolerated_beta(*shifted_gains(k_1, k_2, gamma)) - beta

    if reserve(end) >= 0.0:  # beta = 0: nothing but stability counts
        return float(end)
    return float(brentq(reserve, 0.0, end, xtol=1e-14 * end))


def lyapunov_matrix(k_1: float, k_2: float, beta: float, gamma: float) -> Array:
    """(2, 2) M for which (51) holds with equality, from its Riccati equation.

    Solved for ``eta_2`` in units of K_1 eta_1, time in units of 2 / K_1 and V in units of
    2 beta^2 / K_1, for the paper's gains span four decades: then only ``2 K_2 / K_1^2`` and
    ``2 beta / K_1^2`` are left.
    """
    kappa, disturbance = 2.0 * k_2 / k_1**2, 2.0 * beta / k_1**2
    a = np.array([[-1.0, 1.0], [-kappa, 0.0]]) + gamma / k_1 * np.eye(2)
    scaled = solve_continuous_are(a, disturbance * B, C.T @ C, -np.eye(1))
    units = np.array([1.0, 1.0 / k_1])
    return np.asarray(2.0 * beta**2 / k_1 * np.outer(units, units) * scaled)


def certify(k_1: float, k_2: float, beta: float) -> Certificate | None:
    """M and nearly the largest gamma of (51) for a ``beta`` above 0; None if there is none."""
    largest = largest_gamma(k_1, k_2, beta)
    if largest is None or beta <= 0.0:
        return None
    gamma = (1.0 - MARGIN) * largest
    m = lyapunov_matrix(k_1, k_2, beta, 0.5 * (gamma + largest))
    left = residual(m, k_1, k_2, beta, gamma)
    eigenvalues = np.asarray(np.linalg.eigvalsh(m), dtype=np.float64)
    return Certificate(beta, gamma, m, eigenvalues, left)
