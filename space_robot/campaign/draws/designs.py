"""Designs of experiments: the uniform random numbers of a campaign's runs.

Each number depends only on the campaign's seed, a name and a number: not on the process, on the
order of the draws, or on other draws.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from hashlib import blake2b
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import InputError

_PERSON = b"space_robot"
BITS = 52
"""Random bits of a number from `uniform`."""
SOBOL_BITS = 30
_BLOCK = 1024
"""Points of Sobol's sequence that are computed at a time."""


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


class DesignPoint(NamedTuple):
    """Position of a run in its design."""

    draw: int
    """Number of the draw; runs with the same draw differ only in grid values or Saltelli point."""
    point: int
    """Number of the grid point, or of the point in a row of Saltelli's design."""


class Blocks(NamedTuple):
    """Saltelli's design: ``rows`` of d + 2 consecutive runs.

    A row is point A, then A with variable 1 from B, ..., with variable d from B, then point B.
    """

    rows: int
    names: list[str]
    """Names of the d variables."""


@dataclass(frozen=True)
class Design(ABC):
    """Base class of designs: uniform numbers for every random variable (not for grids)."""

    needs_all_runs: ClassVar[bool] = False
    """True if the draws depend on the number of runs."""
    seed: int
    draws: int
    """Number of draws."""

    @abstractmethod
    def uniform(self, place: DesignPoint, name: str, number: int) -> float:
        """Return the uniform number, in (0, 1), of random variable ``number`` for a run."""


class Independent(Design):
    """Independent random numbers."""

    def uniform(self, place: DesignPoint, name: str, number: int) -> float:
        """Return the uniform number of a variable for a draw."""
        return uniform(self.seed, name, place.draw)


class LatinHypercube(Design):
    """Each variable has one number in each of N strata, N the number of draws."""

    needs_all_runs: ClassVar[bool] = True

    def uniform(self, place: DesignPoint, name: str, number: int) -> float:
        """Return the uniform number of a variable for a draw."""
        stratum = permutation(self.seed, name, self.draws)[place.draw]
        inside = uniform(self.seed, name, place.draw)
        return min((int(stratum) + inside) / self.draws, 1.0 - 2.0**-53)


class Sobol(Design):
    """Sobol's sequence with a random digital shift; one dimension per variable."""

    def uniform(self, place: DesignPoint, name: str, number: int) -> float:
        """Return the uniform number of a variable for a draw."""
        return shifted(self.seed, name, place.draw, number)


@dataclass(frozen=True)
class Saltelli(Design):
    """The rows of `Blocks`; A and B are taken from one Sobol sequence."""

    needs_all_runs: ClassVar[bool] = True
    variables: int = 0

    def uniform(self, place: DesignPoint, name: str, number: int) -> float:
        """Return the uniform number of a variable for a draw."""
        is_b = place.point in (number + 1, self.variables + 1)
        dimension = number + self.variables * is_b
        return shifted(self.seed, f"{name}:{'B' if is_b else 'A'}", place.draw, dimension)


DESIGNS: dict[str, type[Design]] = {
    "independent": Independent,
    "latin_hypercube": LatinHypercube,
    "sobol": Sobol,
    "saltelli": Saltelli,
}


def shifted(seed: int, name: str, index: int, dimension: int) -> float:
    """Return a number of Sobol's sequence with a digital shift derived from ``name``."""
    if dimension >= 21_201:
        raise InputError("a Sobol sequence has 21201 dimensions at most")
    shift = bits(seed, f"{name}:shift", 0) >> (64 - BITS)
    block = _sobol_block(_dimensions(dimension), index // _BLOCK)
    own = int(block[index % _BLOCK, dimension]) << (BITS - SOBOL_BITS)
    return unit(own ^ shift)


def _dimensions(dimension: int) -> int:
    """Return how many dimensions are computed together, so that variables share the cache."""
    return min(max(16, 1 << dimension.bit_length()), 21_201)


@lru_cache(maxsize=8)
def _sobol_block(dimensions: int, block: int) -> NDArray[np.int64]:
    from scipy.stats import qmc  # slow to import

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # SciPy warns unless the number of points is a power of two
        sequence = qmc.Sobol(dimensions, scramble=False, bits=SOBOL_BITS)
        if block:
            sequence.fast_forward(block * _BLOCK)
        points = sequence.random(_BLOCK)
    return np.round(points * 2.0**SOBOL_BITS).astype(np.int64)
