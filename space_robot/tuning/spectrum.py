"""The eigenvalues of ``H_S^-1 h_bar`` along a mission, and the margin against wrong torques.

Over a tick the robot obeys ``H_S a_k + c = G_k``: G is the actual force, a the mean acceleration.
A law with time-delay estimation commands ``C_k = h_bar u_k + N_hat_k``. Let a drive produce
``G = a_g C`` and report ``R = b C`` (the applied force of the controller's `TimeDelayPair`). With
the weight w of the pair's low-pass (1: none), (36) is

    N_hat_k = (1 - w) N_hat_k-1 + w (R_k-1 - h_bar a_k-1)
            = ((1 + w (b - 1)) E - w a_g h_bar H_S^-1) N_hat_k-1 + terms of u and c,

so along an eigenvector of ``h_bar H_S^-1``, whose eigenvalues lambda are those of ``H_S^-1 h_bar``
and positive, an error of the estimate is multiplied in each tick by

    1 + w (b - 1 - a_g lambda).                                                             (*)

- Correct torques, w = 1: ``1 - lambda``, Lemma 1's W (69); its magnitude is below 1 for lambda < 2.
- Reported torque too large, ``b = 1 + g``: the matrix is ``(1 + g) E - H_S^-1 h_bar``, which
  diverges for ``g >= min lambda``. The estimate interprets the excess as a force that did not
  accelerate the robot, commands it, and receives it with a further excess.
- Reported torque too small: the estimate decays instead of diverging, and leaves an acceleration
  error of ``h_bar^-1 (1 - b) C``.
- Actual torque wrong, command reported (``b = 1``): lambda becomes ``a_g lambda``. It converges for
  ``a_g < 2 / (w max lambda)``.
- Ideal torque sensor, actual torque too large (``a_g = b``): ``b (1 - lambda)`` for w = 1, so the
  limit is ``g = min lambda / (1 - min lambda)``.

Hence the margin in torque scale is the smallest eigenvalue. If all masses and inertias have
relative errors of at most mu, then ``(1 - mu) H_S <= H_S' <= (1 + mu) H_S``, because the kinetic
energy is linear in them and a free base minimises it: every eigenvalue stays between
``lambda / (1 + mu)`` and ``lambda / (1 - mu)``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

LEAST_MARGIN = 0.02
"""Smallest acceptable margin in torque scale: drives are calibrated to about a percent."""


@dataclass(frozen=True)
class Spectrum:
    """Extreme eigenvalues of ``H_S^-1 h_bar`` over all configurations."""

    smallest: float
    largest: float
    norm: float
    """Largest spectral norm of ``E - H_S^-1 h_bar``, below 1 by Lemma 1."""
    weight: float = 1.0
    """Weight w of the low-pass of the time-delay pair, see `low_pass_weight`; 1: none."""

    @property
    def radius(self) -> float:
        """Largest factor (*) of an error per tick; the estimate converges if it is below 1."""
        return max(abs(1.0 - self.weight * x) for x in (self.smallest, self.largest))

    @property
    def margin(self) -> float:
        """Share by which the reported torque may exceed the commanded one; negative: unstable."""
        return self.smallest if self.contracts else 1.0 - self.radius

    @property
    def largest_scale(self) -> float:
        """Largest stable ratio of actual to commanded torque, if the command is reported."""
        return 2.0 / (self.weight * self.largest)

    @property
    def contracts(self) -> bool:
        """True if the radius is below 1."""
        return self.radius < 1.0

    @property
    def is_sound(self) -> bool:
        """True if the estimate converges with a margin of at least `LEAST_MARGIN`."""
        return self.contracts and self.margin >= LEAST_MARGIN


def spectrum(inertia: Array, h_bar: Array, weight: float = 1.0) -> Spectrum:
    """Return the `Spectrum` of the diagonal ``h_bar`` (m,) over ``inertia`` (K, m, m), H_S."""
    eigen = eigenvalues(inertia, h_bar)
    norm = np.linalg.norm(contraction_matrix(inertia, h_bar), 2, axis=(-2, -1))
    return Spectrum(float(eigen.min()), float(eigen.max()), float(norm.max()), weight)


def eigenvalues(inertia: Array, h_bar: Array) -> Array:
    """Return the ascending eigenvalues (..., m) of ``H_S^-1 h_bar`` for H_S (..., m, m).

    They are those of the symmetric ``h_bar^1/2 H_S^-1 h_bar^1/2``.
    """
    root = np.sqrt(h_bar)
    similar = root[:, np.newaxis] * np.linalg.inv(inertia) * root
    return np.linalg.eigvalsh(0.5 * (similar + similar.swapaxes(-1, -2)))


def contraction_matrix(inertia: Array, h_bar: Array) -> Array:
    """Return ``W = E - H_S^-1 h_bar`` (69) of H_S (..., m, m) and the diagonal ``h_bar`` (m,)."""
    return np.eye(len(h_bar)) - np.linalg.solve(inertia, np.diag(h_bar))
