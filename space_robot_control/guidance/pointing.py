"""Pointing modes: the base turns with a direction that the assumed orbit gives."""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_model.orbit.ephemeris import Ephemeris
from space_robot_model.robot.orientation import Angles, Vector
from space_robot_msgs_py.config.validation import StrictModel

Array = NDArray[np.float64]

Point = Literal["nadir", "velocity", "sun", "target", "inertial"]
ABOUT = ("velocity", "nadir", "normal", "sun", "target")
"""Second directions that have a name; any other is given as a vector on inertial axes."""


class PointingGoal(StrictModel):
    """``base: {point: ...}``: where an axis of the base points, and how the base turns about it."""

    point: Point = Field(
        description="direction in which the axis points: nadir (the Earth's centre), velocity (of "
        "the orbit, inertial), sun, target, or inertial (the key direction)"
    )
    axis: Vector = Field([0.0, 0.0, 1.0], description="axis that points, base frame, any length")
    direction: Vector | None = Field(
        None, description="direction to point in, inertial axes, any length; of point: inertial"
    )
    about: str | Vector | None = Field(
        None,
        description="second direction, towards which about_axis is turned as far as possible: "
        "velocity, nadir, normal (of the orbit), sun, target, or a vector on inertial axes "
        "(none: velocity for nadir, nadir for velocity, normal for target; for sun and inertial "
        "the inertial z axis, or x if z is within 45 degrees of the direction)",
    )
    about_axis: Vector | None = Field(
        None,
        description="axis that is turned towards about, base frame, any length (none: the first "
        "of x, y, z that is at least 45 degrees from axis)",
    )
    offset_deg: Angles = Field(
        [0.0, 0.0, 0.0],
        description="roll, pitch, yaw of the base from the attitude that points, degrees",
    )


class PointingCourse:
    """The base turns so that it points, at any time: also before and after its segment."""

    def __init__(
        self, goal: PointingGoal, ephemeris: Ephemeris | None, begin: float, near: Array
    ) -> None:
        """Take what points where.

        Args:
            goal: the keys of the segment.
            ephemeris: of the assumed orbit; None: there is none.
            begin: s, of the segment.
            near: (4,) quaternion at the begin in whose hemisphere the quaternions begin.

        Raises:
            InputError: there is no orbit or no target, but one is needed; names the key.
        """
        raise NotImplementedError

    def check(self, begin: float, end: float) -> None:
        """Check that the attitude is defined from ``begin`` to ``end``, s.

        Raises:
            InputError: the second direction comes within a degree of the first one, or the target
                to where the robot is; names key and time.
        """
        raise NotImplementedError

    def at(self, time: Array) -> Array:
        """Return (T, 10) at times (T,), s: quaternion, velocity and acceleration, base frame."""
        raise NotImplementedError
