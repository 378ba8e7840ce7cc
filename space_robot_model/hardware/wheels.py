"""The data sheet of reaction wheels."""

from __future__ import annotations

from functools import partial
from typing import Annotated, ClassVar

import numpy as np
from pydantic import AfterValidator, Field

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_WHEELS

from ..elementary.matrices import Array
from .sheets import NO_VECTORS, MountedSheet, Positive, Sizes, Vectors, are_directions, directions

PER_WHEEL = "one value for all wheels, or one per wheel"


class WheelSettings(MountedSheet):
    """Balanced reaction wheels on the base; by default none.

    The base's inertia in the robot's file includes the locked rotors of the wheels.
    """

    section: ClassVar[str] = "wheels"

    axes: Annotated[Vectors, AfterValidator(partial(are_directions, most=MOST_WHEELS))] = Field(
        NO_VECTORS,
        description="spin axes in the base frame: x, y, z of each wheel, one after the other "
        "([0.0]: no wheels)",
    )
    rotor_inertia: Positive = Field(
        [0.01], description=f"inertia of the rotor about its axis, kg m2; {PER_WHEEL}"
    )
    max_torque: Sizes = Field(
        [0.0], description=f"largest torque of the motor, N m (0: no limit); {PER_WHEEL}"
    )
    max_momentum: Sizes = Field(
        [0.0],
        description="momentum (rotor_inertia times speed) up to which the motor accelerates the "
        f"wheel, N m s (0: no limit); {PER_WHEEL}",
    )
    coulomb: Sizes = Field([0.0], description=f"Coulomb friction, N m; {PER_WHEEL}")
    viscous: Sizes = Field([0.0], description=f"viscous friction, N m s/rad; {PER_WHEEL}")
    initial_speed: Vectors = Field(
        [0.0], description=f"speed relative to the base at tick 0, rad/s; {PER_WHEEL}"
    )

    @property
    def unit_axes(self) -> Array:
        """(W, 3) spin axes as unit vectors in the base frame."""
        return directions(self.axes)

    def spin_momenta(self, speeds: Array) -> Array:
        """Return ``J Omega`` (..., W), N m s, for speeds relative to the base (..., W), rad/s."""
        return speeds * self.values("rotor_inertia")

    def check(self, base_inertia: Array) -> None:
        """Check that the settings are consistent with one another and with a base.

        Args:
            base_inertia: (3, 3) of the base with locked wheels about its CoM, kg m2.
        """
        if not self.count:
            return
        values = {name: self.values(name) for name in type(self).model_fields if name != "axes"}
        inertia, axes = values["rotor_inertia"], self.unit_axes
        stored, limits = inertia * np.abs(values["initial_speed"]), values["max_momentum"]
        for i in np.flatnonzero((limits > 0.0) & (stored > limits)):
            raise InputError(
                f"wheels.initial_speed stores {stored[i]:g} N m s in wheel_{i + 1}, "
                f"max_momentum is {limits[i]:g}"
            )
        moments = np.linalg.eigvalsh(base_inertia - (axes.T * inertia) @ axes)
        if not moments[0] > 0.0:
            raise InputError(
                "wheels.rotor_inertia: the base's inertia must be larger than its rotors', without "
                f"them its smallest principal moment is {moments[0]:g} kg m2"
            )
