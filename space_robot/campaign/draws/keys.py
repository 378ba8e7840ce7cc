"""Counter-based random numbers: each depends only on the campaign's seed, a name and a number.

So they do not depend on the process, on the order of the draws, or on other draws.
"""

from __future__ import annotations

from functools import lru_cache
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

_PERSON = b"space_robot"
BITS = 52
"""Random bits of a number from `uniform`."""


def bits(seed: int, name: str, number: int) -> int:
    """Return 64 random bits: the BLAKE2 hash of the arguments."""
    text = f"{seed}:{number}:{name}".encode()
    return int.from_bytes(blake2b(text, digest_size=8, person=_PERSON).digest(), "little")


def uniform(seed: int, name: str, number: int) -> float:
    """Return a uniform random number in the open interval (0, 1)."""
    return unit(bits(seed, name, number) >> (64 - BITS))


def unit(integer: int) -> float:
    """Return ``(integer + 0.5) / 2**BITS``, the centre of an interval of (0, 1)."""
    return (integer + 0.5) * 2.0**-BITS


def noise_seed(seed: int, number: int) -> int:
    """Return the 31-bit seed of the noise of sensors and faults in a draw."""
    return bits(seed, "seed", number) >> 33


@lru_cache(maxsize=256)
def permutation(seed: int, name: str, length: int) -> NDArray[np.int64]:
    """Return the numbers 0 to ``length`` - 1 in random order."""
    key = bits(seed, f"{name}:permutation", 0)
    raw = np.random.Philox(key=key).random_raw(length)  # counter-based: the same bits everywhere
    return np.argsort(raw, kind="stable")
