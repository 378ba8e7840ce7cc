"""Standard normal distribution: cumulative distribution function, quantiles, random numbers."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.lanes import (
    WIDTH,
    all_lanes,
    any_lane,
    as_lanes,
    as_numbers,
    lane_of,
    where,
)

from .exponential import exp, log
from .random_bits import bits_of, following, pcg64

Array = NDArray[np.float64]
Pair = tuple[float, float]

ROOT_TWO_PI = 2.5066282746310007
SERIES_LIMIT = 3.0
"""Limit between series and continued fraction of the cumulative distribution function."""
CENTRE = 0.425
"""Distance from 1/2 up to which Wichura's first pair of polynomials is used."""
UNUSED_BITS = np.uint64(12)
TAIL = 5.0
"""Limit of sqrt(-log p) between his second and third pair."""

# Wichura's coefficients of numerator and denominator, highest power first.
CENTRAL: tuple[Pair, ...] = (
    (2509.0809287301226727, 5226.4952788528545610),
    (33430.575583588128105, 28729.085735721942674),
    (67265.770927008700853, 39307.895800092710610),
    (45921.953931549871457, 21213.794301586595867),
    (13731.693765509461125, 5394.1960214247511077),
    (1971.5909503065514427, 687.18700749205790830),
    (133.14166789178437745, 42.313330701600911252),
    (3.3871328727963666080, 1.0),
)
MIDDLE: tuple[Pair, ...] = (
    (7.74545014278341407640e-4, 1.05075007164441684324e-9),
    (2.27238449892691845833e-2, 5.47593808499534494600e-4),
    (2.41780725177450611770e-1, 1.51986665636164571966e-2),
    (1.27045825245236838258, 1.48103976427480074590e-1),
    (3.64784832476320460504, 6.89767334985100004550e-1),
    (5.76949722146069140550, 1.67638483018380384940),
    (4.63033784615654529590, 2.05319162663775882187),
    (1.42343711074968357734, 1.0),
)
OUTER: tuple[Pair, ...] = (
    (2.01033439929228813265e-7, 2.04426310338993978564e-15),
    (2.71155556874348757815e-5, 1.42151175831644588870e-7),
    (1.24266094738807843860e-3, 1.84631831751005468180e-5),
    (2.65321895265761230930e-2, 7.86869131145613259100e-4),
    (2.96560571828504891230e-1, 1.48753612908506148525e-2),
    (1.78482653991729133580, 1.36929880922735805310e-1),
    (5.46378491116411436990, 5.99832206555887937690e-1),
    (6.65790464350110377720, 1.0),
)


def normal_quantile(share: ArrayLike) -> Array:
    """Return the standard normal quantiles of probabilities ``share``, in their shape.

    They are minus infinity at 0, infinity at 1, and NaN outside.
    """
    shares = np.asarray(share, dtype=np.float64)
    quantiles = np.empty(shares.size)
    _quantiles(np.ascontiguousarray(shares).reshape(-1), quantiles)
    return quantiles.reshape(shares.shape)


@kernel
def normal_numbers(draws: Array, seed: float, key: int, block: int) -> None:
    """Fill ``draws`` with standard normal numbers, a function of the three integers.

    They are the quantiles of 2**52 equidistant probabilities in (0, 1), selected by the upper bits
    that ``numpy.random.PCG64((seed, key, block))`` gives.

    Args:
        draws: a multiple of eight numbers, or, in lanes, the numbers of eight flights.
        seed: of each flight; below 2**32, as the others.
        key: of what is drawn.
        block: counts the drawings.
    """
    numbers = as_numbers(draws)
    width = numbers.shape[-1]
    flat = numbers.reshape(-1)
    for lane in range(width):
        state = pcg64(int(lane_of(seed, lane)), key, block)
        for i in range(lane, flat.size, width):
            state = following(state)
            flat[i] = (np.int64(bits_of(state) >> UNUSED_BITS) + 0.5) * 2.0**-52
    eights = as_lanes(flat.reshape(-1, WIDTH))
    for i in range(eights.size):
        eights[i] = quantile(eights[i])


@kernel
def _quantiles(shares: Array, out: Array) -> None:
    for i in range(out.size):
        out[i] = quantile(shares[i])


@kernel
def quantile(share: float) -> float:
    """Return `normal_quantile` of one number, for kernels.

    M. J. Wichura, "Algorithm AS 241: The Percentage Points of the Normal Distribution", Applied
    Statistics 37 (1988). The error is below 6 units in the last place.
    """
    q = share - 0.5
    is_central = abs(q) <= CENTRE
    value = q * _ratio(CENTRAL, CENTRE * CENTRE - q * q)
    if all_lanes(is_central):
        return value
    small = where(q < 0.0, share, 1.0 - share)
    r = np.sqrt(-log(small))
    tail = _ratio(MIDDLE, r - 1.6)
    if any_lane(r > TAIL):
        tail = where(r > TAIL, _ratio(OUTER, r - TAIL), tail)
    tail = where(small > 0.0, tail, where(small == 0.0, math.inf, math.nan))
    return where(is_central, value, where(q < 0.0, -tail, tail))


@subroutine
def _ratio(polynomials: tuple[Pair, ...], r: float) -> float:
    """Return the ratio of two polynomials in ``r``, from their pairs of coefficients."""
    above, below = polynomials[0]
    for k in range(1, len(polynomials)):
        above, below = polynomials[k][0] + r * above, polynomials[k][1] + r * below
    return above / below


@kernel
def normal_cdf(z: float) -> float:
    """Return the standard normal cumulative distribution function at ``z``.

    For |z| up to 3 it is ``1/2 + phi(z) (z + z^3/3 + z^5/(3 5) + ...)``, beyond it Laplace's
    continued fraction ``phi(z) / (z + 1/(z + 2/(z + ...)))``. The relative error is below 3e-13.
    """
    if np.isnan(z):
        return z
    size = abs(z)
    density = exp(-0.5 * size * size) / ROOT_TWO_PI
    if size <= SERIES_LIMIT:
        term, total, k = size, size, 3.0
        while term > 1e-17 * total:
            term *= size * size / k
            total, k = total + term, k + 2.0
        return 0.5 + math.copysign(density * total, z)
    rest = size
    for k in range(120, 0, -1):
        rest = size + k / rest
    return density / rest if z < 0.0 else 1.0 - density / rest
