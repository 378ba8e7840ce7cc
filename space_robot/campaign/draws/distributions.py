"""Random numbers of variables: quantiles of their distributions, and designs of experiments.

Each uniform number of a design depends only on the campaign's seed, a name and a number: not on the
process, on the order of the draws, or on other draws.
"""

from __future__ import annotations

import math
import warnings
from abc import abstractmethod
from functools import cached_property, lru_cache
from hashlib import blake2b
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import (
    AfterValidator,
    Field,
    ValidationError,
    ValidationInfo,
    field_validator,
    model_validator,
)
from typing_extensions import Self

from space_robot_model.elementary.functions import exp, log
from space_robot_model.elementary.normal import quantile
from space_robot_msgs_py.config.text import nearest
from space_robot_msgs_py.config.validation import StrictModel, short, validate
from space_robot_msgs_py.errors import InputError

Value = float | int | str | bool
"""A drawn value; integers occur only in lists of values."""


def _rising(bounds: list[float]) -> list[float]:
    if not bounds[0] < bounds[1]:
        raise ValueError("a lower bound and a higher one were expected, in this order")
    return bounds


Bounds = Annotated[list[float], Field(min_length=2, max_length=2), AfterValidator(_rising)]
Values = Annotated[list[bool | int | float | str], Field(min_length=1, max_length=100_000)]

LEAST_SHARE = 2.0**-1000
"""Smallest probability of which a normal quantile is computed."""

BITS = 52
"""Random bits of a number from `uniform`."""
SOBOL_BITS = 30
MOST_DIMENSIONS = 21_201
_BLOCK = 1024
"""Points of Sobol's sequence that are computed at a time."""


class Distribution(StrictModel):
    """Base class of the distributions in a campaign's file."""

    is_continuous: ClassVar[bool] = True
    relative: bool = False
    """True if the drawn value is a factor of the nominal value."""
    offset: bool = False
    """True if the drawn value is added to the nominal value."""

    @model_validator(mode="after")
    def _one_way(self) -> Self:
        if self.relative and self.offset:
            raise ValueError("relative and offset cannot both be true")
        return self

    @abstractmethod
    def quantile(self, u: float) -> Value:
        """Return the quantile of probability ``u``, 0 < u < 1."""

    @property
    def ends(self) -> list[Value]:
        """The least and the largest value that can be drawn; all values of a list."""
        return [self.quantile(2.0**-53), self.quantile(1.0 - 2.0**-53)]

    @property
    def is_number(self) -> bool:
        """True if all values are numbers."""
        return not any(isinstance(value, (str, bool)) for value in self.ends)

    def on(self, nominal: float, drawn: Value) -> Any:
        """Apply a drawn value to a nominal one: as factor, offset or replacement."""
        if self.relative:
            return nominal * float(drawn)
        if self.offset:  # a whole number of ticks remains one
            return nominal + (drawn if isinstance(drawn, int) else float(drawn))
        return drawn

    def at_least(self, factor: float, nominal: float) -> Distribution:
        """Return the distribution with results of at least ``factor`` times the nominal value."""
        low = factor if self.relative else (factor - self.offset) * nominal
        return self._truncated(low)

    def _truncated(self, low: float) -> Distribution:
        if (least := min(float(value) for value in self.ends)) < low:
            raise InputError(f"can be {least:g}: must be {low:g} or more")
        return self


class Normal(Distribution):
    """Normal distribution, truncated at ``low`` and ``high`` if set."""

    normal: float
    sigma: Annotated[float, Field(gt=0.0)]
    low: float | None = None
    high: float | None = None

    @model_validator(mode="after")
    def _has_values(self) -> Self:
        low, high = self._probabilities
        if not high - low > 1e-12:
            raise ValueError("no values left: low must be below high, both near the mean")
        return self

    @cached_property
    def _probabilities(self) -> tuple[float, float]:
        from scipy.special import ndtr  # slow to import

        low, high = (
            otherwise if bound is None else float(ndtr((bound - self.normal) / self.sigma))
            for bound, otherwise in ((self.low, 0.0), (self.high, 1.0))
        )
        return low, high

    def quantile(self, u: float) -> float:  # noqa: D102
        low, high = self._probabilities
        share = min(max(low + u * (high - low), LEAST_SHARE), 1.0 - 2.0**-53)
        value = self.normal + self.sigma * quantile(share)
        value = value if self.low is None else max(value, self.low)
        return value if self.high is None else min(value, self.high)

    def _truncated(self, low: float) -> Normal:
        if self.low is not None and self.low >= low:
            return self
        try:
            return type(self).model_validate({**self.model_dump(), "low": low})
        except ValidationError:
            raise InputError(f"no values left: must be {low:g} or more") from None


class Uniform(Distribution):
    """Uniform distribution between two values."""

    uniform: Bounds

    def quantile(self, u: float) -> float:  # noqa: D102
        low, high = self.uniform
        return min(max(low + u * (high - low), low), high)


class LogUniform(Distribution):
    """Uniform distribution of the logarithm."""

    log_uniform: Bounds

    @field_validator("log_uniform", mode="after")
    @classmethod
    def _is_positive(cls, bounds: list[float]) -> list[float]:
        if not bounds[0] > 0.0:
            raise ValueError("numbers above 0 were expected")
        return bounds

    @cached_property
    def _span(self) -> float:
        low, high = self.log_uniform
        return log(high / low)

    def quantile(self, u: float) -> float:  # noqa: D102
        low, high = self.log_uniform
        return min(max(low * exp(u * self._span), low), high)


class Categorical(Distribution):
    """Base class of distributions over a list of numbers or texts."""

    is_continuous: ClassVar[bool] = False
    values: Values

    @property
    def ends(self) -> list[Value]:
        """Return all values."""
        return list(dict.fromkeys(self.values))

    @model_validator(mode="after")
    def _are_alike(self) -> Self:
        if len({isinstance(value, (str, bool)) for value in self.values}) > 1:
            raise ValueError("numbers and texts are mixed: put the numbers in quotes")
        if (self.relative or self.offset) and not self.is_number:
            raise ValueError("relative and offset need numbers")
        return self


class Choice(Categorical):
    """A random value of a list, with optional weights (default: equal)."""

    values: Annotated[Values, Field(alias="choice")]
    weights: list[Annotated[float, Field(ge=0.0)]] | None = None

    @field_validator("weights", mode="after")
    @classmethod
    def _fit(cls, weights: list[float] | None, info: ValidationInfo) -> list[float] | None:
        if weights is not None:
            if len(weights) != len(info.data.get("values", weights)):
                raise ValueError("one weight for each value of choice was expected")
            if not 0.0 < sum(weights) < math.inf:
                raise ValueError("at least one weight must be above 0")
        return weights

    def quantile(self, u: float) -> Value:  # noqa: D102
        weights = self.weights or [1.0] * len(self.values)
        left = u * sum(weights)
        for value, weight in zip(self.values, weights, strict=True):
            left -= weight
            if left < 0.0:
                return value
        return self.values[-1]


class Grid(Categorical):
    """Every value of a list in turn."""

    values: Annotated[Values, Field(alias="grid")]

    def quantile(self, u: float) -> Value:  # noqa: D102
        return self.values[int(u * len(self.values))]


KINDS: dict[str, type[Distribution]] = {
    "normal": Normal,
    "uniform": Uniform,
    "log_uniform": LogUniform,
    "choice": Choice,
    "grid": Grid,
}
"""Distribution classes by the key that selects them."""


def read_distribution(value: Any, where: str) -> Distribution:
    """Read a distribution; a plain number or text is a constant."""
    if isinstance(value, (bool, int, float, str)):
        return validate(Choice, {"choice": [value]}, where)
    if isinstance(value, dict):
        for key, kind in KINDS.items():
            if key in value:
                return validate(kind, value, where)
    keys = [str(key) for key in value] if isinstance(value, dict) else []
    near = " or ".join(dict.fromkeys(kind for key in keys for kind in nearest(key, list(KINDS))))
    raise InputError(
        f"{where}: a distribution was expected, a mapping with one of {', '.join(KINDS)}, "
        f"got {short(value)}" + (f" (did you mean {near}?)" if near else "")
    )


def bits(seed: int, name: str, number: int) -> int:
    """Return 64 random bits: the BLAKE2 hash of the arguments."""
    text = f"{seed}:{number}:{name}".encode()
    hashed = blake2b(text, digest_size=8, person=b"space_robot").digest()
    return int.from_bytes(hashed, "little")


def uniform(seed: int, name: str, number: int) -> float:
    """Return a uniform random number in the open interval (0, 1)."""
    return _unit(bits(seed, name, number) >> (64 - BITS))


def _unit(integer: int) -> float:
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


class Design(NamedTuple):
    """Uniform numbers of every random variable (not of grids), by the design of a study.

    A row of Saltelli's design has d + 2 runs: point A, then A with variable 1 from B, ..., with
    variable d from B, then point B; A and B are taken from one Sobol sequence.
    """

    name: str
    seed: int
    draws: int
    """Number of draws."""
    variables: int
    """Number d of variables."""

    def uniform(self, place: DesignPoint, name: str, number: int) -> float:
        """Return the uniform number, in (0, 1), of random variable ``number`` for a run."""
        match self.name:
            case "independent":
                return uniform(self.seed, name, place.draw)
            case "latin_hypercube":  # one number in each of as many strata as there are draws
                stratum = int(permutation(self.seed, name, self.draws)[place.draw])
                inside = uniform(self.seed, name, place.draw)
                return min((stratum + inside) / self.draws, 1.0 - 2.0**-53)
            case "sobol":
                return shifted(self.seed, name, place.draw, number)
        is_b = place.point in (number + 1, self.variables + 1)
        dimension = number + self.variables * is_b
        return shifted(self.seed, f"{name}:{'B' if is_b else 'A'}", place.draw, dimension)


def shifted(seed: int, name: str, index: int, dimension: int) -> float:
    """Return a number of Sobol's sequence with a digital shift derived from ``name``."""
    if dimension >= MOST_DIMENSIONS:
        raise InputError(f"a Sobol sequence has {MOST_DIMENSIONS} dimensions at most")
    shift = bits(seed, f"{name}:shift", 0) >> (64 - BITS)
    # variables share the cache: as many dimensions are computed as the next power of two
    dimensions = min(max(16, 1 << dimension.bit_length()), MOST_DIMENSIONS)
    block = _sobol_block(dimensions, index // _BLOCK)
    return _unit((int(block[index % _BLOCK, dimension]) << (BITS - SOBOL_BITS)) ^ shift)


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
