"""Orientations as they are written in files."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from space_robot_msgs_py.config.validation import StrictModel

from ..elementary.matrices import direction_norm, norm
from ..elementary.rotations import quaternion_of_rotation, rotation_of_rpy

Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Degrees = Annotated[float, Field(ge=-36_000.0, le=36_000.0)]
"""An angle of at most a hundred turns: of larger ones too few digits are left."""
Angles = Annotated[list[Degrees], Field(min_length=3, max_length=3)]
Rate = Annotated[float, Field(ge=-3_600.0, le=3_600.0)]
"""An angular velocity of at most ten turns a second, degrees/s."""
Rates = Annotated[list[Rate], Field(min_length=3, max_length=3)]
Quaternion = Annotated[list[float], Field(min_length=4, max_length=4)]


class Orientation(StrictModel):
    """An orientation, as roll, pitch and yaw about fixed axes or as a quaternion; or none."""

    rpy_deg: Angles | None = Field(None, description="roll, pitch, yaw about fixed axes, degrees")
    quaternion: Quaternion | None = Field(None, description="w, x, y, z")

    @model_validator(mode="after")
    def _is_unit(self) -> Orientation:
        if self.rpy_deg is not None and self.quaternion is not None:
            raise ValueError("rpy_deg and quaternion were given: give one of them")
        if self.quaternion is not None:
            direction_norm(self.quaternion, "quaternion")
        return self

    @property
    def is_given(self) -> bool:
        """Whether there is an orientation."""
        return self.rpy_deg is not None or self.quaternion is not None

    @property
    def unit_quaternion(self) -> NDArray[np.float64]:
        """(4,) ``[w, x, y, z]``; the identity if none is given."""
        if self.quaternion is not None:
            return np.array(self.quaternion) / norm(self.quaternion)
        return quaternion_of_rotation(rotation_of_rpy(np.radians(self.rpy_deg or [0.0] * 3)))


class Attitude(Orientation):
    """An orientation that must be given: that of the base."""

    @model_validator(mode="after")
    def _must_be_given(self) -> Attitude:
        if not self.is_given:
            raise ValueError("give rpy_deg or quaternion")
        return self
