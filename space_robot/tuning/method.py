"""Tuning of a gain set for all five laws, in six steps.

1. **Shape of h_bar.** ``d_i``, the smallest inertia of axis i when all others are free,
   ``1 / (H_S^-1)_ii``, along the mission and with every payload. The ratio of the extreme
   eigenvalues of ``H_S^-1 h_bar`` is then within a factor m of the best diagonal matrix
   (van der Sluis 1969).
2. **Size of h_bar.** The smallest ``h_bar = alpha d`` that leaves the margin in torque scale (see
   `spectrum`) with a mass error mu: ``alpha min(lambda) / (1 + mu) = margin``. It is the smallest
   because noise is proportional to h_bar.
3. **Low-pass of the time-delay pair.** The largest eigenvalue may then exceed 1 or even 2. With a
   low-pass of weight w the estimate's error is multiplied by ``1 - w lambda`` per tick. w is the
   largest weight for which this factor is not negative, ``w alpha max(lambda) / (1 - mu) <= 1``,
   and for which the noise, h_bar times that of the pair's acceleration (`noise`), is within the
   allowed ripple: a share of the largest force of the axis along the mission.
4. **Bandwidth.** The estimate is delayed by ``T = delta / w`` plus the lag of the navigation: the
   acceleration of an axis follows its command with a pole at ``margin / T`` rad/s in the slowest
   direction. With poles at W the loop is ``s^3 / p + s^2 + 2 W s + W^2``, whose complex pair has
   a damping of 0.7 for ``W = p / 4``. Ripple and bandwidth are both proportional to margin / T:
   more margin needs a slower low-pass, more bandwidth gives more ripple. Computed torque uses no
   estimate. Its W is four times slower than the navigation's lag, at most `MOST_PER_TICK`, and
   within the allowed ripple: it multiplies the noise of rate and angle by ``H_S (2 W, W^2)``.
5. **Errors of the estimate.** Within a tick the estimate has the error
   ``h_bar eps = T dF_S/dt + (1 - b) F_S``, with b the reported share of the torque, assumed wrong
   by half of the margin. F_S is that of inverse dynamics along the mission.
6. **Laws.** ``K_P = W^2``, ``K_D = 2 W``, ``lambda = W``. The rate of eps within the bandwidth is
   ``L = W eps``. TDE-SMC: ``g = h_bar eps``, the smallest gain that can hold the surface. TDE-STC:
   ``K_2 = 1.1 L`` of Levant (1998), and ``K_1 = 2.2 L^1/2`` for the paper's ``K_1^2 > 4 K_2``.
   TDE-TSMC: ``K_1 = L^1/2``, which balances eps at ``|s| = eps / W``. CTC-SMC: g is the force that
   the nominal model does not contain; the boundary layer is that of Slotine and Li (1991, 7.2):
   inside it s decays with rate W, and not faster in any direction, ``Delta = g / (W d')`` with
   ``d'`` proportional to the shape of h_bar and ``H_S^-1 d' <= E``.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import InputError

from .demand import ForceDemand
from .noise import Noise
from .spectrum import eigenvalues

Array = NDArray[np.float64]

SEPARATION = 4.0
"""Ratio of the estimate's pole to the poles of the loop; see step 4."""
MOST_PER_TICK = 0.05
"""Largest bandwidth times period, rad: K_D then removes a tenth of a rate error per tick."""
LEAST_WEIGHT = 1e-4
"""Smallest weight of a low-pass: a corner of 0.03 Hz at 2 kHz."""
BISECTIONS = 12
"""Bisections: the weight is then more precise than the written digits."""
DIGITS = 3
"""Significant digits of a gain: few enough to be equal on all machines."""


@dataclass(frozen=True)
class TuningOptions:
    """Requirements on a gain set."""

    margin: float
    """Share by which the reported torque may exceed the commanded one."""
    mass_uncertainty: float
    """Share by which every mass and inertia may be wrong."""
    bandwidth: float | None = None
    """Bandwidth of all laws, rad/s; None: the largest that lag and ripple allow each law."""
    ripple: float = 0.1
    """Allowed RMS force by noise, as a share of the largest force of an axis."""


@dataclass(frozen=True)
class Tuned:
    """A gain set, with intermediate results of the method."""

    wishes: TuningOptions
    corner_hz: float
    """Corner of the low-pass of the time-delay pair, Hz."""
    delay: float
    """T of step 4, s."""
    bandwidth: float
    """W of the laws with time-delay estimation, rad/s."""
    model_bandwidth: float
    """W of the laws with a model, rad/s."""
    smallest: float
    """Smallest eigenvalue of ``H_S^-1 h_bar`` with nominal masses and every payload."""
    largest: float
    """Largest eigenvalue of the same."""
    error: Array
    """(m,) eps of step 5, rad/s2 (eps: 1/s2)."""
    gains: Mapping[str, Mapping[str, Array]]
    """Gains by law and name, (m,) each."""


def tune(
    inertia: Array,
    asked: ForceDemand,
    wishes: TuningOptions,
    period: float,
    noise: Noise | None = None,
) -> Tuned:
    """Compute a gain set.

    Args:
        inertia: (K, m, m) H_S in all configurations, with all payloads.
        asked: forces of the mission.
        wishes: the user's tuning options.
        period: delta, s.
        noise: of sensors and navigation, and its lag (None: no noise, no lag).

    Raises:
        InputError: the tuning options cannot be met together.
    """
    margin, share = wishes.margin, wishes.mass_uncertainty
    shape = axis_inertia(inertia)
    asked = asked.on_all_axes(shape)
    eigen = eigenvalues(inertia, shape)
    low, high = float(eigen.min()), float(eigen.max())
    size = margin * (1.0 + share) / low
    weight = min(1.0, (1.0 - share) / (size * high))
    h_bar, allowed = size * shape, wishes.ripple * asked.peak
    if noise:
        weight = _quiet_weight(weight, noise, allowed / h_bar)
    delay = period / weight + (noise.lag if noise else 0.0)
    fastest = margin / delay / SEPARATION
    bandwidth = wishes.bandwidth or fastest
    quiet = _quiet_bandwidth(inertia, noise, allowed)
    of_model = wishes.bandwidth or min(quiet, MOST_PER_TICK / period)
    if noise and noise.lag and not wishes.bandwidth:
        of_model = min(of_model, 1.0 / SEPARATION / noise.lag)
    if bandwidth > 2.0 * fastest:
        raise InputError(
            f"bandwidth must be at most {2.0 * fastest:.3g} rad/s, half of the pole of an estimate "
            f"with this margin and lag, got {bandwidth:g}"
        )
    gap = delay * asked.slope + 0.5 * margin * asked.peak
    error = gap / h_bar
    layer = shape * (1.0 - share) / high
    unknown = asked.unknown + share * asked.nominal
    ones = np.ones_like(shape)
    rough = bandwidth * error
    slope, poles = bandwidth * ones, _critical(bandwidth * ones)
    gains = {
        "ctc": _critical(of_model * ones),
        "ctc_smc": {"lambda": of_model * ones, "g": unknown, "delta": unknown / (of_model * layer)},
        "tde_smc": {"h_bar": h_bar, "lambda": slope, "g": gap},
        "tde_tsmc": {"h_bar": h_bar, **poles, "k_1": np.sqrt(rough)},
        "tde_stc": {
            "h_bar": h_bar,
            "lambda": slope,
            "k_1": 2.2 * np.sqrt(rough),
            "k_2": 1.1 * rough,
        },
    }
    rounded = {
        law: {name: significant(values) for name, values in own.items()}
        for law, own in gains.items()
    }
    corner = float(significant(low_pass_corner(weight, period)))
    return Tuned(
        wishes, corner, delay, bandwidth, of_model, size * low, size * high, error, rounded
    )


def _critical(bandwidth: Array) -> dict[str, Array]:
    """Return K_P and K_D with both poles at ``bandwidth`` (m,), rad/s."""
    return {"k_p": bandwidth**2, "k_d": 2.0 * bandwidth}


def axis_inertia(inertia: Array) -> Array:
    """Return d_i (m,) of step 1 for ``inertia`` (K, m, m), kg m2."""
    free = 1.0 / np.diagonal(np.linalg.inv(inertia), axis1=1, axis2=2)
    smallest: Array = free.min(axis=0)
    return smallest


def _quiet_weight(largest: float, noise: Noise, allowed: Array) -> float:
    """Return the largest weight, at most ``largest``, with noise up to ``allowed`` (m,), rad/s2.

    Raises:
        InputError: there is no such weight.
    """
    if np.all(noise.acceleration(largest) <= allowed):
        return largest
    low, high = math.log(LEAST_WEIGHT), math.log(largest)
    if np.any(noise.acceleration(LEAST_WEIGHT) > allowed):
        raise InputError("no low-pass reduces the noise of these sensors enough: allow more ripple")
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        is_quiet = np.all(noise.acceleration(math.exp(middle)) <= allowed)
        low, high = (middle, high) if is_quiet else (low, middle)
    return math.exp(low)


def _quiet_bandwidth(inertia: Array, noise: Noise | None, allowed: Array) -> float:
    """Return the largest W of computed torque, rad/s, with noise up to ``allowed`` (m,), N m.

    ``H^2 (4 W^2 sigma_rate^2 + W^4 sigma_e^2) = allowed^2`` on the limiting axis.
    """
    if noise is None or not noise.rates.any():
        return math.inf
    own = np.diagonal(inertia, axis1=1, axis2=2).max(axis=0)
    rate, angle = 2.0 * own * noise.rates.std(axis=0), own * noise.errors.std(axis=0)
    root = np.sqrt(rate**4 + 4.0 * (angle * allowed) ** 2)
    with np.errstate(divide="ignore"):
        squares = 2.0 * allowed**2 / (rate**2 + root)
    return float(np.sqrt(squares.min()))


def low_pass_corner(weight: float, period: float) -> float:
    """Return the corner, Hz, of a low-pass with a ``weight``; 0 (no low-pass) for 1."""
    return 0.0 if weight >= 1.0 else -math.log(1.0 - weight) / (2.0 * math.pi * period)


def significant(values: Array | float) -> Array:
    """Round to `DIGITS` significant digits."""
    rounded: Array = np.vectorize(lambda value: float(f"{value:.{DIGITS}g}"))(values)
    return rounded
