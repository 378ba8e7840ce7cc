"""What all variables of the plant's robot have in common: their class, and their distributions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from space_robot_msgs_py.errors import InputError

from .distributions import Distribution, read_distribution
from .variable import Variable

LEAST = 0.01
"""Lower bound of positive quantities, as a factor of the nominal ones."""


@dataclass(frozen=True)
class OfRobot(Variable):
    """Base class of variables of a body, or of the joint that moves it."""

    body: int

    @property
    def is_of_plant_robot(self) -> bool:
        """Return whether the variable changes the plant's robot alone."""
        return True


def read_number(value: Any, where: str) -> Distribution:
    """Read the distribution of a number.

    Raises:
        InputError: invalid distribution, or one of texts.
    """
    distribution = read_distribution(value, where)
    if not distribution.is_number:
        raise InputError(f"{where}: numbers were expected")
    return distribution


def read_positive(value: Any, where: str, nominal: float) -> Distribution:
    """Read the distribution of a positive quantity; a normal one is truncated.

    Raises:
        InputError: see `read_number`; or it can be less than `LEAST` of the nominal value.
    """
    distribution = read_number(value, where)
    if distribution.relative:
        least = LEAST
    else:
        least = (LEAST - 1.0) * nominal if distribution.offset else LEAST * nominal
    return at_least(distribution, least, where)


def read_not_negative(value: Any, where: str, nominal: float) -> Distribution:
    """Read the distribution of a quantity that can be 0; a normal one is truncated.

    Raises:
        InputError: see `read_number`; or it can be negative.
    """
    distribution = read_number(value, where)
    return at_least(distribution, -nominal if distribution.offset else 0.0, where)


def at_least(distribution: Distribution, least: float, where: str) -> Distribution:
    """Return the distribution with no value below ``least``; a normal one is truncated there.

    Raises:
        InputError: a distribution other than normal has values below.
    """
    try:
        return distribution.at_least(least)
    except ValueError as error:
        raise InputError(f"{where}: {' '.join(str(error).split())}") from None
