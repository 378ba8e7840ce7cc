"""Flat lists of vectors and values, as in ROS parameters, for actuators on the base."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_msgs_py.errors import InputError

from ..elementary.matrices import direction_norm, unit_rows

Array = NDArray[np.float64]

NO_VECTORS = [0.0]
"""Value for an empty list, because ROS has no empty list of numbers."""
FEWEST = Field(min_length=1)
Vectors = Annotated[list[Annotated[float, Field(ge=-1e3, le=1e3)]], FEWEST]
Sizes = Annotated[list[Annotated[float, Field(ge=0.0, le=1e9)]], FEWEST]
Positive = Annotated[list[Annotated[float, Field(gt=0.0, le=1e9)]], FEWEST]


def are_vectors(flat: list[float], most: int) -> list[float]:
    """Return ``flat`` if it has x, y, z of at most ``most`` vectors, or none (``[0.0]``).

    Raises:
        ValueError: another number of values.
    """
    if flat != NO_VECTORS and (len(flat) % 3 or len(flat) > 3 * most):
        raise ValueError(
            f"x, y, z of at most {most} vectors were expected, or [0.0] for none: "
            f"{len(flat)} numbers"
        )
    return flat


def are_directions(flat: list[float], most: int) -> list[float]:
    """Return ``flat`` if all its vectors can be scaled to norm 1, see `are_vectors`.

    Raises:
        ValueError: a vector is too short or too long.
    """
    for i, vector in enumerate(vectors(are_vectors(flat, most)), 1):
        direction_norm(vector, f"vector {i}")
    return flat


def vectors(flat: list[float]) -> Array:
    """Return the vectors (k, 3) of a flat list."""
    if flat == NO_VECTORS:
        return np.empty((0, 3))
    return np.array(flat, dtype=np.float64).reshape(-1, 3)


def directions(flat: list[float]) -> Array:
    """Return the vectors (k, 3) of a flat list, normalised."""
    return unit_rows(vectors(flat))


def values_of(numbers: list[float], key: str, count: int, what: str) -> Array:
    """Return the values (count,) of a setting with one value for all, or one for each.

    Raises:
        InputError: another number of values.
    """
    if len(numbers) not in (1, count):
        raise InputError(
            f"{key} has {len(numbers)} values, one for all or {count} are allowed: one per {what}"
        )
    values: Array = np.broadcast_to(np.array(numbers, dtype=np.float64), count)
    return values
