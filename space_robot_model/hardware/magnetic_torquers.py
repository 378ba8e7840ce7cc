"""The data sheet of magnetic torquers."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.samples import MOST_TORQUERS

from .mounting import NO_VECTORS, Positive, Vectors, are_directions, directions, values_of

Array = NDArray[np.float64]


def _axes(flat: list[float]) -> list[float]:
    return are_directions(flat, MOST_TORQUERS)


class MagneticTorquerSettings(StrictModel):
    """Magnetic torquers on the base, which unload its wheels; by default none.

    A dipole m in the magnetic field B turns the base with ``m x B``, never about the field.
    """

    axes: Annotated[Vectors, AfterValidator(_axes)] = Field(
        NO_VECTORS,
        description="directions of the dipoles in the base frame: x, y, z of each torquer, one "
        "after the other ([0.0]: no torquers)",
    )
    max_dipole: Positive = Field(
        [100.0],
        description="largest dipole either way, A m2; one value for all torquers, or one per "
        "torquer",
    )

    @property
    def count(self) -> int:
        """Number of torquers."""
        return len(directions(self.axes))

    @property
    def unit_axes(self) -> Array:
        """(M, 3) directions of the dipoles as unit vectors in the base frame."""
        return directions(self.axes)

    @property
    def largest(self) -> Array:
        """(M,) largest dipoles, A m2.

        Raises:
            InputError: neither one value, nor one per torquer.
        """
        return values_of(
            self.max_dipole, "magnetic_torquers.max_dipole", self.count, "magnetic torquer"
        )
