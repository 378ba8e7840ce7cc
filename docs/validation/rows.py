"""A row of the table of docs/validation.md, and what its sections share."""

from __future__ import annotations

from importlib.metadata import version
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

PINOCCHIO, MUJOCO, SCIPY = (
    f"{name} {version(package)}"
    for name, package in (("Pinocchio", "pin"), ("MuJoCo", "mujoco"), ("SciPy", "scipy"))
)


class ValidationRow(NamedTuple):
    """A comparison with something independent."""

    check: str
    """What of this project is compared."""
    against: str
    """What with, and its version."""
    extent: str
    """Over how many cases or seconds."""
    difference: float
    """The largest difference; relative where no unit is given."""
    limit: float


def relative(actual: ArrayLike, expected: ArrayLike) -> float:
    """Return the largest difference of two arrays by the largest number of the second."""
    difference = np.abs(np.asarray(actual) - expected).max()
    return float(difference / np.abs(expected).max())
