"""The eigenvalues of ``H_S^-1 h_bar`` along a mission, and what a wrong torque may add to them.

Over a tick the robot obeys ``H_S a_k + c = G_k``: G is the force given, a the mean acceleration.
A law with time-delay estimation commands ``C_k = h_bar u_k + N_hat_k``. Let a drive give
``G = a_g C`` and let ``R = b C`` be reported (the applied force of the controller's
`TimeDelayPair`). With the weight w of the pair's low-pass (1: none), (36) is

    N_hat_k = (1 - w) N_hat_k-1 + w (R_k-1 - h_bar a_k-1)
            = ((1 + w (b - 1)) E - w a_g h_bar H_S^-1) N_hat_k-1 + terms of u and c,

so along an eigenvector of ``h_bar H_S^-1``, whose eigenvalues lambda are those of ``H_S^-1 h_bar``
and positive, an error of the estimate is multiplied in every tick by

    1 + w (b - 1 - a_g lambda).                                                             (*)

- All as it should be, w = 1: ``1 - lambda``, Lemma 1's W (69); its size is below 1 for lambda < 2.
- Reported too much, ``b = 1 + g``: the matrix is ``(1 + g) E - H_S^-1 h_bar``, and diverges from
  ``g = min lambda`` on. The estimate takes the surplus for a force that did not accelerate
  anything, commands it, and finds it reported with another surplus.
- Reported too little: it does not diverge, but forgets, and leaves an acceleration error of
  ``h_bar^-1 (1 - b) C``.
- Another torque given than commanded, and the command reported (``b = 1``): nothing but lambda
  changes, to ``a_g lambda``. It is harmless up to ``a_g = 2 / (w max lambda)``.
- A perfect torque sensor on a drive that gives too much (``a_g = b``): ``b (1 - lambda)`` for
  w = 1, so the limit is ``g = min lambda / (1 - min lambda)``.

Hence the margin in torque scale is the smallest eigenvalue. Masses and inertias that are each
wrong by a share of at most mu keep ``(1 - mu) H_S <= H_S' <= (1 + mu) H_S``, for the kinetic energy
is linear in them and a free base minimises it: every eigenvalue stays within ``lambda / (1 + mu)``
and ``lambda / (1 - mu)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_MARGIN = 0.02
"""Margin in torque scale below which a set is not sound: drives are calibrated to a percent."""


@dataclass(frozen=True)
class Spectrum:
    """Extreme eigenvalues of ``H_S^-1 h_bar`` over the configurations looked at."""

    smallest: float
    largest: float
    norm: float
    """Largest spectral norm of ``E - H_S^-1 h_bar``, which Lemma 1 asks to be below 1."""
    weight: float = 1.0
    """Weight w of the low-pass of the time-delay pair, see `low_pass_weight`; 1: none."""

    @property
    def radius(self) -> float:
        """Largest factor (*) of an error in a tick; the estimate contracts below 1."""
        return max(abs(1.0 - self.weight * x) for x in (self.smallest, self.largest))

    @property
    def margin(self) -> float:
        """Share by which the reported torque may exceed the commanded one; negative: none."""
        return self.smallest if self.contracts else 1.0 - self.radius

    @property
    def largest_scale(self) -> float:
        """Torque given per torque commanded up to which it contracts, the command reported."""
        return 2.0 / (self.weight * self.largest)

    @property
    def contracts(self) -> bool:
        """True if the radius is below 1."""
        return self.radius < 1.0

    @property
    def is_sound(self) -> bool:
        """True if it contracts with at least `LEAST_MARGIN`."""
        return self.contracts and self.margin >= LEAST_MARGIN


def spectrum(inertia: Array, h_bar: Array, weight: float = 1.0) -> Spectrum:
    """Return the `Spectrum` of the diagonal ``h_bar`` (m,) over ``inertia`` (K, m, m), H_S."""
    eigen = eigenvalues(inertia, h_bar)
    norm = np.linalg.norm(contraction_matrix(inertia, h_bar), 2, axis=(-2, -1))
    return Spectrum(float(eigen.min()), float(eigen.max()), float(norm.max()), weight)


def eigenvalues(inertia: Array, h_bar: Array) -> Array:
    """Return the eigenvalues (..., m) of ``H_S^-1 h_bar``, rising, of ``inertia`` (..., m, m).

    They are those of the symmetric ``h_bar^1/2 H_S^-1 h_bar^1/2``.
    """
    root = np.sqrt(h_bar)
    similar = root[:, np.newaxis] * np.linalg.inv(inertia) * root
    return np.linalg.eigvalsh(0.5 * (similar + similar.swapaxes(-1, -2)))


def contraction_matrix(inertia: Array, h_bar: Array) -> Array:
    """(69): ``W = E - H_S^-1 h_bar`` of ``inertia`` (..., m, m) and the diagonal ``h_bar`` (m,)."""
    return np.eye(len(h_bar)) - np.linalg.solve(inertia, np.diag(h_bar))
