"""Check of the arguments of functions for people."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_msgs_py.config.arguments import as_numbers
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ..elementary.matrices import norm

Array = NDArray[np.float64]


def vector(value: ArrayLike, size: int, name: str) -> Array:
    """Return an argument as an array (size,).

    Raises:
        InputError: it has another type or shape; names it.
    """
    array = np.ascontiguousarray(as_numbers(value, name))
    if array.shape != (size,):
        raise InputError(f"{name} must have shape ({size},), got {array.shape}")
    return array


def unit_quaternion(value: ArrayLike) -> Array:
    """Return the argument ``quaternion_wxyz`` (4,), normalised.

    Raises:
        InputError: it has another type or shape, or is not unit.
    """
    array = vector(value, 4, "quaternion_wxyz")
    length = norm(array)
    if not abs(length - 1.0) < 1e-6:
        raise InputError(f"quaternion_wxyz must have norm 1, got {length}")
    return array / length


def check_robot(robot: Any) -> None:
    """Check that an argument is a `Robot`.

    Raises:
        InputError: it is not.
    """
    if not hasattr(robot, "joint_count"):
        raise InputError(f"robot: a Robot was expected, got {short(robot)}")
