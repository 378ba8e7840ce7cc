"""Distributions of variables, defined by their quantile functions."""

from __future__ import annotations

import math
from abc import abstractmethod
from functools import cached_property
from typing import Annotated, Any, ClassVar

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
        return nominal + float(drawn) if self.offset else drawn

    def at_least(self, factor: float, nominal: float) -> Distribution:
        """Return the distribution with results of at least ``factor`` times the nominal value.

        Raises:
            InputError: it has smaller results, and is not normal; a normal one is truncated.
        """
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

    def quantile(self, u: float) -> float:
        """Return the quantile of probability ``u``."""
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

    def quantile(self, u: float) -> float:
        """Return the quantile of probability ``u``."""
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

    def quantile(self, u: float) -> float:
        """Return the quantile of probability ``u``."""
        low, high = self.log_uniform
        return min(max(low * exp(u * self._span), low), high)


class Categorical(Distribution):
    """Base class of distributions over a list of numbers or texts."""

    is_continuous: ClassVar[bool] = False

    @property
    @abstractmethod
    def values(self) -> list[Any]:
        """The possible values."""

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

    choice: Values
    weights: list[Annotated[float, Field(ge=0.0)]] | None = None

    @field_validator("weights", mode="after")
    @classmethod
    def _fit(cls, weights: list[float] | None, info: ValidationInfo) -> list[float] | None:
        if weights is not None:
            if len(weights) != len(info.data.get("choice", weights)):
                raise ValueError("one weight for each value of choice was expected")
            if not 0.0 < sum(weights) < math.inf:
                raise ValueError("at least one weight must be above 0")
        return weights

    @property
    def values(self) -> list[Any]:
        """Return the possible values."""
        return self.choice

    def quantile(self, u: float) -> Value:
        """Return the quantile of probability ``u``."""
        weights = self.weights or [1.0] * len(self.choice)
        left = u * sum(weights)
        for value, weight in zip(self.choice, weights, strict=True):
            left -= weight
            if left < 0.0:
                return value
        return self.choice[-1]


class Grid(Categorical):
    """Every value of a list in turn."""

    grid: Values

    @property
    def values(self) -> list[Any]:
        """Return the possible values."""
        return self.grid

    def quantile(self, u: float) -> Value:
        """Return the quantile of probability ``u``."""
        return self.grid[int(u * len(self.grid))]


KINDS: dict[str, type[Distribution]] = {
    "normal": Normal,
    "uniform": Uniform,
    "log_uniform": LogUniform,
    "choice": Choice,
    "grid": Grid,
}
"""Distribution classes by the key that selects them."""


def read_distribution(value: Any, where: str) -> Distribution:
    """Read a distribution; a plain number or text is a constant.

    Raises:
        InputError: invalid distribution; ``where`` names file and key.
    """
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
