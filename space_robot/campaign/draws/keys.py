"""Random numbers by name: each is a function of the campaign's seed, a name and a number alone.

So it does not matter who draws them, in which order, or what else is drawn.
"""

from __future__ import annotations

from functools import lru_cache
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

_PERSON = b"space_robot"
BITS = 52
"""Random bits of a number from `uniform`; one more makes it the middle of its interval."""


def bits(seed: int, name: str, number: int) -> int:
    """Return 64 random bits: BLAKE2 of what they are a function of."""
    text = f"{seed}:{number}:{name}".encode()
    return int.from_bytes(blake2b(text, digest_size=8, person=_PERSON).digest(), "little")


def uniform(seed: int, name: str, number: int) -> float:
    """Return a number between 0 and 1, neither of them."""
    return unit(bits(seed, name, number) >> (64 - BITS))


def unit(integer: int) -> float:
    """Return the middle of the interval of 0 to 1 that an integer of so many `BITS` counts."""
    return (integer + 0.5) * 2.0**-BITS


def noise_seed(seed: int, number: int) -> int:
    """Return the seed of the noise of sensors and faults in a run's draw, 31 bits."""
    return bits(seed, "seed", number) >> 33


@lru_cache(maxsize=256)
def permutation(seed: int, name: str, length: int) -> NDArray[np.int64]:
    """Return the numbers 0 to ``length`` - 1 in random order."""
    key = bits(seed, f"{name}:permutation", 0)
    raw = np.random.Philox(key=key).random_raw(length)  # a counter's cipher: defined bit by bit
    return np.argsort(raw, kind="stable")
