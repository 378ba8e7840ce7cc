"""Random bits of NumPy's generator `PCG64`, in kernels.

Seeds are spread by the hash of NumPy's `SeedSequence`; the generator is PCG XSL RR 128/64 of
M. E. O'Neill, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms for
Random Number Generation", Harvey Mudd College, HMC-CS-2014-0905 (2014).
"""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel, subroutine

Pair = tuple[np.uint64, np.uint64]
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


@kernel
def pcg64(first: int, second: int, third: int) -> State:
    """Return the state of ``numpy.random.PCG64((first, second, third))``.

    The three seeds are integers from 0 to 2**32 - 1.
    """
    pool = np.zeros(POOL, np.uint64)
    pool[0], pool[1], pool[2] = np.uint64(first), np.uint64(second), np.uint64(third)
    constant = HASH
    for i in range(POOL):
        pool[i], constant = _hashed(pool[i], constant, HASH_FACTOR)
    for i in range(POOL):
        for k in range(POOL):
            if i != k:
                value, constant = _hashed(pool[i], constant, HASH_FACTOR)
                mixed = (MIX_LEFT * pool[k] - MIX_RIGHT * value) & LOW
                pool[k] = mixed ^ (mixed >> HALF)
    words = np.zeros(WORDS, np.uint64)
    constant = OUT_HASH
    for i in range(WORDS):
        words[i], constant = _hashed(pool[i % POOL], constant, OUT_FACTOR)
    high, low = words[0] | (words[1] << WORD), words[2] | (words[3] << WORD)
    upper, lower = words[4] | (words[5] << WORD), words[6] | (words[7] << WORD)
    step_high, step_low = (upper << ONE) | (lower >> np.uint64(63)), (lower << ONE) | ONE
    high, low = _sum(step_high, step_low, high, low)
    return following((high, low, step_high, step_low))


@subroutine
def _hashed(value: np.uint64, constant: np.uint64, factor: np.uint64) -> Pair:
    """Return the hash of a word, and the next constant."""
    value = value ^ constant
    constant = (constant * factor) & LOW
    value = (value * constant) & LOW
    return value ^ (value >> HALF), constant


@subroutine
def _sum(high: np.uint64, low: np.uint64, other_high: np.uint64, other_low: np.uint64) -> Pair:
    """Return the sum of two numbers of 128 bits."""
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
    high, low = _sum(high, low * FACTOR_LOW, step_high, step_low)
    return high, low, step_high, step_low


@subroutine
def bits_of(state: State) -> np.uint64:
    """Return the 64 random bits that the generator gives in ``state``."""
    high, low = state[0], state[1]
    turn, value = high >> TOP, high ^ low
    return (value >> turn) | (value << ((FULL - turn) & np.uint64(63)))
