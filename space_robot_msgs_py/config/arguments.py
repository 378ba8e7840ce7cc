"""Checks of the arguments of public functions.

An argument that is something else is an `InputError` with its name and value.
"""

from __future__ import annotations

import operator
import os
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import InputError
from .validation import short

Array = NDArray[np.float64]


def as_path(value: Any, name: str) -> Path:
    """Return a value as a path."""
    if not isinstance(value, (str, os.PathLike)):
        raise InputError(f"{name}: a path was expected, got {short(value)}")
    return Path(value)


def path_text(value: Any, name: str) -> str:
    """Return a path as written; `pathlib` would remove the ``./`` of ``./one``."""
    as_path(value, name)
    return str(value)


def as_numbers(value: Any, name: str) -> Array:
    """Return real numbers as an array of any shape, float64."""
    try:
        numbers = np.asarray(value)
    except ValueError:
        numbers = np.empty(0, dtype=object)
    if numbers.dtype.kind not in "iuf" or np.ma.is_masked(value):
        raise InputError(f"{name}: numbers were expected, got {short(value)}")
    return numbers.astype(np.float64)


def as_positive(value: Any, name: str) -> float:
    """Return a finite number above 0."""
    number = as_numbers(value, name)
    if number.shape or not 0.0 < number < np.inf:
        raise InputError(f"{name}: a number above 0 was expected, got {short(value)}")
    return float(number)


def as_whole_number(value: Any, name: str, least: int, most: int | None = None) -> int:
    """Return an integer in a range."""
    allowed = f"{least} or more" if most is None else f"{least} to {most}"
    try:
        number = operator.index(value)
    except TypeError:
        raise InputError(f"{name}: a whole number was expected, got {short(value)}") from None
    if isinstance(value, (bool, np.bool_)):
        raise InputError(f"{name}: a whole number was expected, got {value}")
    if number < least or (most is not None and number > most):
        raise InputError(f"{name}: {allowed} is allowed, got {number}")
    return number
