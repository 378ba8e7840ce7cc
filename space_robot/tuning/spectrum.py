"""The eigenvalues of ``H_S^-1 H^`` along a mission, and the margin against wrong torques.

H^ is the inertia of a law's time-delay estimate: the constant diagonal ``h_bar``, or the nominal
model's H_S, which differs from the robot's by the errors of the masses and the payload.

Over a tick the robot obeys ``H_S a_k + c = G_k``: G is the actual force, a the mean acceleration.
A law with time-delay estimation commands ``C_k = H^ u_k + N_hat_k``. Let a drive produce
``G = a_g C`` and report ``R = b C`` (the applied force of the controller's `TimeDelayPair`). With
the weight w of the pair's low-pass (1: none), (36) is

    N_hat_k = (1 - w) N_hat_k-1 + w (R_k-1 - h_bar a_k-1)
            = ((1 + w (b - 1)) E - w a_g h_bar H_S^-1) N_hat_k-1 + terms of u and c,

so along an eigenvector of ``h_bar H_S^-1``, whose eigenvalues lambda are those of ``H_S^-1 h_bar``
and positive, an error of the estimate is multiplied in each tick by

    1 + w (b - 1 - a_g lambda).                                                             (*)

- Correct torques, w = 1: ``1 - lambda``, Lemma 1's W (69); its magnitude is below 1 for lambda < 2.
- Reported torque too large, ``b = 1 + g``: the matrix is ``(1 + g) E - H_S^-1 H^``, which
  diverges for ``g >= min lambda``. The estimate interprets the excess as a force that did not
  accelerate the robot, commands it, and receives it with a further excess.
- Reported torque too small: the estimate decays instead of diverging, and leaves an acceleration
  error of ``H^^-1 (1 - b) C``.
- Actual torque wrong, command reported (``b = 1``): lambda becomes ``a_g lambda``. It converges for
  ``a_g < 2 / (w max lambda)``.
- Ideal torque sensor, actual torque too large (``a_g = b``): ``b (1 - lambda)`` for w = 1, so the
  limit is ``g = min lambda / (1 - min lambda)``.

Hence the margin in torque scale is the smallest eigenvalue. If all masses and inertias have
relative errors of at most mu, then ``(1 - mu) H_S <= H_S' <= (1 + mu) H_S``, because the kinetic
energy is linear in them and a free base minimises it: every eigenvalue stays between
``lambda / (1 + mu)`` and ``lambda / (1 - mu)``. With the nominal inertia and no payload these are
``1 / (1 + mu)`` and ``1 / (1 - mu)``: a margin near 1, whatever the robot.

A disturbance observer of inertia J and bandwidth g, `dob`, is the estimate with ``H^ = J`` and
``w = g period / (1 + g period)``. With a weight for each axis, W in place of w, the factors are the
eigenvalues of ``E + W ((b - 1) E - J H_S^-1)``. They are real, and the first one reaches 1 where
``b - 1`` is the smallest lambda (Sylvester), so the margin is the same.

The terms of u depend on the estimate as well, through the motion of the robot. They move the limit
by a share of the order of the law's bandwidth times ``period / w``; `closed_loop` has them all.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from space_robot_control.guidance.mission import MissionSettings
from space_robot_model.robot import Robot

from .inertia import inertia_along

Array = NDArray[np.float64]

LEAST_MARGIN = 0.02
"""Smallest acceptable margin in torque scale: drives are calibrated to about a percent."""


@dataclass(frozen=True)
class Spectrum:
    """Extreme eigenvalues of ``H_S^-1 H^`` over all configurations."""

    smallest: float
    largest: float
    norm: float
    """Largest spectral norm of ``E - H_S^-1 H^``, below 1 by Lemma 1."""
    weight: float = 1.0
    """Weight w of the low-pass of the estimate, see `low_pass_weight`; 1: none. Of an observer with
    different weights: the largest."""
    least_weight: float | None = None
    """The smallest of these; None: the same."""

    @property
    def radius(self) -> float:
        """Largest factor (*) of an error per tick, or its bound if axes have different weights.

        The estimate converges if it is below 1.
        """
        least = self.weight if self.least_weight is None else self.least_weight
        return max(abs(1.0 - least * self.smallest), abs(1.0 - self.weight * self.largest))

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


def spectrum(inertia: Array, assumed: Array, weight: float | Array = 1.0) -> Spectrum:
    """Return the `Spectrum` over ``inertia`` (K, m, m), H_S.

    Args:
        inertia: of the robot.
        assumed: H^ of the estimate: (m,) diagonal, or (K, m, m).
        weight: w of its low-pass, or (m,) for a diagonal H^.
    """
    eigen = eigenvalues(inertia, assumed)
    norm = np.linalg.norm(contraction_matrix(inertia, assumed), 2, axis=(-2, -1))
    extremes = float(eigen.min()), float(eigen.max()), float(norm.max())
    weights = np.atleast_1d(np.asarray(weight, dtype=np.float64))
    if np.all(weights == weights[0]):
        return Spectrum(*extremes, float(weights[0]))
    return Spectrum(*extremes, float(weights.max()), float(weights.min()))


def eigenvalues(inertia: Array, assumed: Array) -> Array:
    """Return the ascending eigenvalues (..., m) of ``H_S^-1 H^`` for H_S (..., m, m).

    They are those of the symmetric ``L^T H_S^-1 L`` with ``H^ = L L^T``.

    Args:
        inertia: H_S.
        assumed: H^, (m,) diagonal or (..., m, m).
    """
    root = np.diag(np.sqrt(assumed)) if assumed.ndim == 1 else np.linalg.cholesky(assumed)
    similar = root.swapaxes(-1, -2) @ np.linalg.inv(inertia) @ root
    return np.linalg.eigvalsh(0.5 * (similar + similar.swapaxes(-1, -2)))


def contraction_matrix(inertia: Array, assumed: Array) -> Array:
    """Return ``W = E - H_S^-1 H^`` (69) of H_S (..., m, m) and H^, (m,) diagonal or (..., m, m)."""
    whole = np.diag(assumed) if assumed.ndim == 1 else assumed
    return np.eye(inertia.shape[-1]) - np.linalg.solve(inertia, whole)


DRAWS, SEED = 16, 1
"""Size and seed of the sample."""
COARSE = 1.0
"""Time between two configurations in which it is evaluated, s."""


@dataclass(frozen=True)
class MassCheck:
    """Extreme eigenvalues with masses and inertias wrong by up to a share."""

    share: float
    """mu."""
    smallest: float
    """Bound: it is the margin in torque scale, if the largest one times the weight is below 2."""
    largest: float
    """Bound."""
    smallest_drawn: float
    """The smallest one of the sample."""
    largest_drawn: float
    """The largest one of the sample."""


def drawn_inertias(
    robot: Robot,
    settings: MissionSettings,
    share: float,
    step: float = COARSE,
    controls_base: bool = True,
) -> Array:
    """Return H_S, or H_f, (R, L, m, m) along a mission of robots whose bodies are not as in a file.

    Each body has its own factor on its mass and its own on its inertia, ``1 - share`` to
    ``1 + share``. Other arguments are those of `inertia_along`.
    """
    rng, inertias = np.random.default_rng(SEED), []
    for _ in range(DRAWS):
        masses, inertia = 1.0 + share * rng.uniform(-1.0, 1.0, (2, len(robot.mass)))
        wrong = replace(
            robot,
            mass=robot.mass * masses,
            inertia=robot.inertia * inertia[:, np.newaxis, np.newaxis],
        )
        inertias.append(inertia_along(wrong, settings, step, controls_base))
    return np.array(inertias)


def check_masses(spectrum: Spectrum, assumed: Array, drawn: Array, share: float) -> MassCheck:
    """Return the extreme eigenvalues with wrong masses.

    Args:
        spectrum: with the right ones.
        assumed: H^, (m,) diagonal, or (L, m, m) in the configurations of ``drawn``.
        drawn: (R, L, m, m), see `drawn_inertias`.
        share: mu.
    """
    eigen = eigenvalues(drawn, assumed)
    return MassCheck(
        share,
        spectrum.smallest / (1.0 + share),
        spectrum.largest / (1.0 - share),
        float(eigen.min()),
        float(eigen.max()),
    )
