"""Designs of experiments: uniform numbers of the runs of a campaign."""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import InputError

from . import keys

SOBOL_BITS = 30
_BLOCK = 1024
"""Points of Sobol's sequence that are made at a time."""


class DesignPoint(NamedTuple):
    """Position of a run in its design."""

    draw: int
    """The number of its draw; runs that share it share what they do not vary."""
    point: int
    """The point of the grid, or the block of Saltelli's design."""


class Blocks(NamedTuple):
    """Saltelli's design: ``rows`` of d + 2 runs that follow one another.

    A row is point A, then A with variable 1 from B, ..., with variable d from B, then point B.
    """

    rows: int
    names: list[str]
    """The d variables."""


@dataclass(frozen=True)
class Design(ABC):
    """Uniform numbers for every variable that is drawn (not those of grids)."""

    needs_all_runs: ClassVar[bool] = False
    """True if another number of runs is another campaign."""
    seed: int
    draws: int
    """So many draws are asked of it."""

    @abstractmethod
    def uniform(self, place: DesignPoint, name: str, number: int) -> float:
        """Return the number between 0 and 1 of a variable, the ``number``-th that is drawn."""


class Independent(Design):
    """Independent random numbers."""

    def uniform(self, place: DesignPoint, name: str, number: int) -> float:
        """Return the uniform number of a variable for a draw."""
        return keys.uniform(self.seed, name, place.draw)


class LatinHypercube(Design):
    """Each variable has one number in every stratum of as many as there are draws."""

    needs_all_runs: ClassVar[bool] = True

    def uniform(self, place: DesignPoint, name: str, number: int) -> float:
        """Return the uniform number of a variable for a draw."""
        stratum = keys.permutation(self.seed, name, self.draws)[place.draw]
        inside = keys.uniform(self.seed, name, place.draw)
        return min((int(stratum) + inside) / self.draws, 1.0 - 2.0**-53)


class Sobol(Design):
    """Sobol's sequence, each variable a dimension, shifted by random bits of its own."""

    def uniform(self, place: DesignPoint, name: str, number: int) -> float:
        """Return the uniform number of a variable for a draw."""
        return shifted(self.seed, name, place.draw, number)


@dataclass(frozen=True)
class Saltelli(Design):
    """The rows of `Blocks`, A and B of one Sobol sequence."""

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
    """Return a number of Sobol's sequence, its bits shifted by random ones of the name."""
    if dimension >= 21_201:
        raise InputError("a Sobol sequence has 21201 dimensions at most")
    shift = keys.bits(seed, f"{name}:shift", 0) >> (64 - keys.BITS)
    block = _sobol_block(_dimensions(dimension), index // _BLOCK)
    own = int(block[index % _BLOCK, dimension]) << (keys.BITS - SOBOL_BITS)
    return keys.unit(own ^ shift)


def _dimensions(dimension: int) -> int:
    """Return how many are made together, so that variables share what is kept."""
    return min(max(16, 1 << dimension.bit_length()), 21_201)


@lru_cache(maxsize=8)
def _sobol_block(dimensions: int, block: int) -> NDArray[np.int64]:
    from scipy.stats import qmc  # slow to import

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it asks for numbers of points that are powers of two
        sequence = qmc.Sobol(dimensions, scramble=False, bits=SOBOL_BITS)
        if block:
            sequence.fast_forward(block * _BLOCK)
        points = sequence.random(_BLOCK)
    return np.round(points * 2.0**SOBOL_BITS).astype(np.int64)
