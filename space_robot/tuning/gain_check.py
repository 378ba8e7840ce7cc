"""Check of a law's gains along a mission, without flying it: stability, margin and noise gain.

Each law gets three results:

- Its **margin** against a wrong torque scale, if what it commands depends on the applied force. For
  time-delay estimation it is the smallest eigenvalue of ``H_S^-1 H^``, likewise for a disturbance
  observer; for any other law with an observer, such as `adrc`, it is the largest excess of the
  reported torque with which the loop of `closed_loop` is stable.
- The **radius** of that loop, of small motions of the rigid robot under the linear part of the law.
- Its **noise gain** per axis: torque per unit of white noise of the axis' measured rate in the same
  tick, N m s, on all paths of the law's `linear_law`, with N_hat as ``-w H^ v / period`` for the
  noise v. The noise of the other axes is not in it.

The effect of noise on switching terms depends on its size: ``g sign(s)`` adds up to g, and the
roots of super-twisting and of the terminal sliding mode add ``h_bar K_1 |s|^1/2``. The torque on
the base, about its axes, is ``J0^T F``, and rhodot is ``J0 omega_e``. A base without attitude
actuators has no torques, and the joints have the inertia H_f of `inertia`.

Margin
------
H^ is the inertia of a law's time-delay estimate: the constant diagonal ``h_bar``, or the nominal
model's H_S. Over a tick the robot obeys ``H_S a_k + c = G_k``, G the actual force and a the mean
acceleration; the law commands ``C_k = H^ u_k + N_hat_k``. Let a drive produce ``G = a_g C`` and
report ``R = b C``. With the weight w of the pair's low-pass (1: none), (36) is

    N_hat_k = (1 - w) N_hat_k-1 + w (R_k-1 - h_bar a_k-1)
            = ((1 + w (b - 1)) E - w a_g h_bar H_S^-1) N_hat_k-1 + terms of u and c,

so along an eigenvector of ``h_bar H_S^-1``, whose eigenvalues lambda are those of ``H_S^-1 h_bar``
and positive, an error of the estimate is multiplied in each tick by

    1 + w (b - 1 - a_g lambda).                                                             (*)

With correct torques and w = 1 this is ``1 - lambda``, Lemma 1's W (69). With a reported torque too
large, ``b = 1 + g``, it diverges for ``g >= min lambda``: the estimate takes the excess for a force
that did not accelerate the robot, and commands it again. With a wrong actual torque and the command
reported it converges for ``a_g < 2 / (w max lambda)``.

Hence the margin in torque scale is the smallest eigenvalue. If all masses and inertias have
relative errors of at most mu, then ``(1 - mu) H_S <= H_S' <= (1 + mu) H_S``, because the kinetic
energy is linear in them and a free base minimises it: every eigenvalue stays between
``lambda / (1 + mu)`` and ``lambda / (1 - mu)``. A disturbance observer of inertia J and bandwidth
g, `dob`, is the estimate with ``H^ = J`` and ``w = g period / (1 + g period)``; with a weight for
each axis the first factor reaches 1 at the smallest lambda, too (Sylvester). The terms of u move
the limit by the order of the law's bandwidth times ``period / w``; `closed_loop` has them all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.laws import ControlLaw
from space_robot_control.laws.base import CONSTANT_INERTIA, NO_ESTIMATE
from space_robot_control.navigation.rate_filters import low_pass_weight
from space_robot_model.elementary.matrices import Array

from .closed_loop import SLOWEST_GROWTH, RigidLoop
from .flexible import FlexibleCheck
from .inertia import J0, Posture
from .linear_law import linear_laws

LOOPS = 31
"""Largest number of postures in which the loop is closed."""


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


@dataclass(frozen=True)
class LoopCheck:
    """The rigid closed loop of the linear part of a law along a mission."""

    radius: float
    """Largest growth of a small motion in a tick."""
    margin: float | None
    """Share by which the reported torque may exceed the commanded one, at most
    `closed_loop.MOST_SCALE`, of a law that uses it and has no `Spectrum`; negative: it is unstable
    without."""
    largest_scale: float | None
    """Largest stable ratio of actual to commanded torque, of the same."""

    @property
    def is_stable(self) -> bool:
        """True if no small motion grows."""
        return self.radius <= 1.0 + SLOWEST_GROWTH

    @property
    def has_margin(self) -> bool:
        """False if there is a margin below `LEAST_MARGIN`."""
        return self.margin is None or self.margin >= LEAST_MARGIN


@dataclass(frozen=True)
class GainCheck:
    """Result of the check of one law."""

    law: str
    spectrum: Spectrum | None
    """Eigenvalues and margin; None for a law without time-delay estimation."""
    loop: LoopCheck
    noise_gain: Array
    """(m,) torque per unit of noise on the rate of the same axis, N m s."""
    flexible: FlexibleCheck | None = None
    """Stability on a robot with gears; None for one without."""

    @property
    def is_sound(self) -> bool:
        """False if the margin is too small, or small motions of robot or springs grow."""
        return self.has_margin and self.is_stable

    @property
    def margin(self) -> float | None:
        """The margin in torque scale; None for a law that does not use the applied force."""
        return self.spectrum.margin if self.spectrum else self.loop.margin

    @property
    def has_margin(self) -> bool:
        """False if the law has a margin in torque scale that is too small."""
        return self.spectrum.is_sound if self.spectrum else self.loop.has_margin

    @property
    def is_stable(self) -> bool:
        """False if the estimate, small motions of the rigid robot, or of a gear's spring, grow."""
        converges = self.spectrum is None or self.spectrum.contracts
        springs_hold = self.flexible is None or self.flexible.is_stable
        return converges and self.loop.is_stable and springs_hold


def pair_corner(settings: ControllerNodeSettings) -> float:
    """Return the corner, Hz, of the low-pass of the whole time-delay pair (0: none).

    It is the pair's own low-pass or the navigation filter: both delay rates and torques equally.
    """
    corners = [settings.acceleration_filter_hz]
    if settings.navigation == "filtered":
        own = settings.navigation_filter
        both = (own.rate_filter_hz, own.joint_bandwidth_hz)
        corners.append(max(both) if min(both) > 0.0 else 0.0)
    return min((corner for corner in corners if corner > 0.0), default=0.0)


def check_gains(
    law: ControlLaw,
    inertia: Array,
    postures: Sequence[Posture],
    acceleration_filter_hz: float = 0.0,
) -> GainCheck:
    """Compute margin, loop and noise gain of a law.

    Args:
        law: with its gains and period.
        inertia: (L, m, m) H_S of the robot in all configurations; (L, n, n) H_f of the joints for a
            base without attitude actuators.
        postures: (K,) of the nominal robot; L is a multiple of K.
        acceleration_filter_hz: see `pair_corner`.
    """
    weight = low_pass_weight(acceleration_filter_hz, law.period) or 1.0
    eigen = estimate_spectrum(law, inertia, postures, weight)
    loop = check_loop(law, inertia, postures, weight, has_margin=eigen is None)
    return GainCheck(law.name, eigen, loop, noise_gain(law, postures, weight))


def estimate_spectrum(
    law: ControlLaw, inertia: Array, postures: Sequence[Posture], weight: float = 1.0
) -> Spectrum | None:
    """Return the `Spectrum` of a law's estimate; None: it has none that is known by its algebra.

    Args: see `check_gains`; ``weight`` is that of the pair's low-pass.
    """
    assumed = estimated_with(law, postures, len(inertia))
    if assumed is None:
        return None
    if law.estimate == NO_ESTIMATE:
        per_tick = law.gain_values["bandwidth"][-inertia.shape[-1] :] * law.period
        return spectrum(inertia, assumed, per_tick / (1.0 + per_tick))
    return spectrum(inertia, assumed, weight)


def estimated_with(law: ControlLaw, postures: Sequence[Posture], count: int) -> Array | None:
    """Return the inertia of a law's estimate: (m,) diagonal, or (``count``, m, m) in all postures.

    That of a disturbance observer is its gain ``inertia``; it has a gain ``bandwidth``, too.
    """
    axes, gains = postures[0].axes, law.gain_values
    if law.estimate == CONSTANT_INERTIA:
        return gains["h_bar"][-axes:]
    if law.estimate != NO_ESTIMATE:
        nominal = np.array([posture.inertia for posture in postures])
        return np.tile(nominal, (count // len(nominal), 1, 1))
    return gains["inertia"][-axes:] if {"inertia", "bandwidth"} <= gains.keys() else None


def check_loop(
    law: ControlLaw,
    inertia: Array,
    postures: Sequence[Posture],
    weight: float = 1.0,
    has_margin: bool = True,
) -> LoopCheck:
    """Check the rigid closed loop in some of the postures.

    Args: see `check_gains`; ``weight`` is that of the pair's low-pass.
        has_margin: whether the margin in torque scale is wanted.
    """
    every = _every(postures)
    some = postures[::every]
    linear = linear_laws(law, some)
    sets = inertia.reshape(-1, len(postures), *inertia.shape[1:])[:, ::every]
    rigid = RigidLoop(
        sets.reshape(-1, *inertia.shape[1:]), [*some] * len(sets), linear * len(sets), weight
    )
    radius = rigid.radius()
    if not (has_margin and (linear[0].uses("applied_force") or linear[0].uses("n_hat"))):
        return LoopCheck(radius, None, None)
    return LoopCheck(radius, rigid.margin(), rigid.largest_scale())


def noise_gain(law: ControlLaw, postures: Sequence[Posture], weight: float = 1.0) -> Array:
    """Return the torque (m,) per unit of white noise on each axis' rate, N m s.

    Args:
        law: with its gains and period.
        postures: of the nominal robot.
        weight: of the low-pass of the time-delay pair; 1: none.
    """
    linear = linear_laws(law, _extreme(postures))
    per_rate = np.max([np.abs(np.diag(own.force_by_rate(weight))) for own in linear], axis=0)
    if len(per_rate) < len(law.memory.s):  # no torque on the base
        return np.concatenate([np.zeros(3), per_rate])
    gain: Array = per_rate.copy()
    gain[:3] *= J0 * J0
    return gain


def _every(postures: Sequence[Posture]) -> int:
    """Return the step that leaves at most `LOOPS` postures."""
    return -(-len(postures) // LOOPS)


def _extreme(postures: Sequence[Posture]) -> list[Posture]:
    """Return some postures, and those in which an axis has its largest inertia."""
    own = np.array([np.diag(posture.inertia) for posture in postures])
    chosen = {*range(0, len(postures), _every(postures)), *np.argmax(own, axis=0).tolist()}
    return [postures[index] for index in sorted(chosen)]
