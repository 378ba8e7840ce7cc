"""Normal random numbers: quantiles of the random bits of NumPy's generator `PCG64`.

Seeds are spread by the hash of NumPy's `SeedSequence`; the generator is PCG XSL RR 128/64 of
M. E. O'Neill, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms for
Random Number Generation", Harvey Mudd College, HMC-CS-2014-0905 (2014).
"""

from __future__ import annotations

import math

import numpy as np

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

from .functions import log
from .matrices import Array

Pair = tuple[float, float]
Words = tuple[np.uint64, np.uint64]
State = tuple[np.uint64, np.uint64, np.uint64, np.uint64]
"""State and increment of a generator, the upper and the lower 64 bits of each."""

POOL = 4
"""Words of 32 bits among which seeds are mixed."""
WORDS = 8
"""Words of 32 bits in a state and its increment."""
LOW = np.uint64(0xFFFFFFFF)
HALF, WORD = np.uint64(16), np.uint64(32)
ONE, TOP, FULL = np.uint64(1), np.uint64(58), np.uint64(64)
HASH, HASH_FACTOR = np.uint64(0x43B0D7E5), np.uint64(0x931E8875)
OUT_HASH, OUT_FACTOR = np.uint64(0x8B51F9DD), np.uint64(0x58F38DED)
MIX_LEFT, MIX_RIGHT = np.uint64(0xCA01F9DD), np.uint64(0x4973F715)
FACTOR_HIGH, FACTOR_LOW = np.uint64(0x2360ED051FC65DA4), np.uint64(0x4385DF649FCCF645)
UNUSED_BITS, SPACING, UNIT = np.uint64(12), 2.0**-52, 2.0**-53
CENTRE = 0.425
"""Distance from 1/2 up to which Wichura's first pair of polynomials is used."""
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
            flat[i] = share_of(state)
    eights = as_lanes(flat.reshape(-1, WIDTH))
    for i in range(eights.size):
        eights[i] = quantile(eights[i])


@kernel
def normal_numbers_of_one(draws: Array, seed: float, key: int, block: int) -> None:
    """Fill ``draws`` as `normal_numbers` does, one number after the other: for other processors."""
    flat, state = draws.reshape(-1), pcg64(int(seed), key, block)
    for i in range(flat.size):
        state = following(state)
        flat[i] = quantile(share_of(state))


@subroutine
def share_of(state: State) -> float:
    """Return the probability in (0, 1) that the generator gives in ``state``."""
    # halfway between multiples of 2**-52: never 0 or 1, whose quantiles are infinite
    return (np.int64(bits_of(state) >> UNUSED_BITS) + 0.5) * SPACING


@kernel
def quantile(share: float) -> float:
    """Return the standard normal quantile of probability ``share``.

    It is minus infinity at 0, infinity at 1, and NaN outside. The error is below 6 units in the
    last place (M. J. Wichura, "Algorithm AS 241: The Percentage Points of the Normal
    Distribution", Applied Statistics 37, 1988).
    """
    q = share - 0.5
    is_central = abs(q) <= CENTRE
    value = q * _ratio(CENTRAL, CENTRE * CENTRE - q * q)
    # 85 % of all numbers
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
    above, below = polynomials[0]
    for k in range(1, len(polynomials)):
        above, below = polynomials[k][0] + r * above, polynomials[k][1] + r * below
    return above / below


@kernel
def pcg64(first: int, second: int, third: int) -> State:
    """Return the state of ``numpy.random.PCG64((first, second, third))``.

    The three seeds are integers from 0 to 2**32 - 1.
    """
    pool = np.zeros(POOL, np.uint64)
    pool[0], pool[1], pool[2] = np.uint64(first), np.uint64(second), np.uint64(third)
    constant = HASH
    for i in range(POOL):
        pool[i], constant = _hash(pool[i], constant, HASH_FACTOR)
    for i in range(POOL):
        for k in range(POOL):
            if i != k:
                value, constant = _hash(pool[i], constant, HASH_FACTOR)
                mixed = (MIX_LEFT * pool[k] - MIX_RIGHT * value) & LOW
                pool[k] = mixed ^ (mixed >> HALF)
    words = np.zeros(WORDS, np.uint64)
    constant = OUT_HASH
    for i in range(WORDS):
        words[i], constant = _hash(pool[i % POOL], constant, OUT_FACTOR)
    high, low = words[0] | (words[1] << WORD), words[2] | (words[3] << WORD)
    upper, lower = words[4] | (words[5] << WORD), words[6] | (words[7] << WORD)
    step_high, step_low = (upper << ONE) | (lower >> np.uint64(63)), (lower << ONE) | ONE
    high, low = _add_128(step_high, step_low, high, low)
    return following((high, low, step_high, step_low))


@subroutine
def _hash(value: np.uint64, constant: np.uint64, factor: np.uint64) -> Words:
    value = value ^ constant
    constant = (constant * factor) & LOW
    value = (value * constant) & LOW
    return value ^ (value >> HALF), constant


@subroutine
def _add_128(high: np.uint64, low: np.uint64, other_high: np.uint64, other_low: np.uint64) -> Words:
    total = low + other_low
    return high + other_high + np.uint64(total < low), total


@subroutine
def following(state: State) -> State:
    """Return the state after ``state``: its product with the factor, plus the increment."""
    high, low, step_high, step_low = state
    a, b, c, d = low >> WORD, low & LOW, FACTOR_LOW >> WORD, FACTOR_LOW & LOW
    middle = a * d + (b * d >> WORD)  # the upper half of low times FACTOR_LOW
    carry = (middle & LOW) + b * c
    upper = a * c + (middle >> WORD) + (carry >> WORD)
    high = high * FACTOR_LOW + low * FACTOR_HIGH + upper
    high, low = _add_128(high, low * FACTOR_LOW, step_high, step_low)
    return high, low, step_high, step_low


@subroutine
def unit_of(state: State) -> float:
    """Return the number in [0, 1) that `numpy.random.Generator` makes of the generator's bits."""
    return np.int64(bits_of(state) >> np.uint64(11)) * UNIT


@subroutine
def bits_of(state: State) -> np.uint64:
    """Return the 64 random bits that the generator gives in ``state``."""
    high, low = state[0], state[1]
    turn, value = high >> TOP, high ^ low
    return (value >> turn) | (value << ((FULL - turn) & np.uint64(63)))
