"""The data sheet of a star tracker."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from space_robot_msgs_py.config.validation import StrictModel

from ..elementary.matrices import direction_norm

Angle = Annotated[float, Field(ge=0.0, le=1.0)]

LEAST_RATE = 1e-6
"""Smallest rate, Hz: one measurement in eleven days."""
MOST_UNDER_WAY = 64
"""Maximum number of measurements that are not released yet."""


def has_direction(vector: list[float]) -> list[float]:
    """Return ``vector`` if it can be scaled to norm 1.

    Raises:
        ValueError: the vector is too short or too long.
    """
    direction_norm(vector, "a direction")
    return vector


class StarTrackerSettings(StrictModel):
    """A star tracker; by default without error, at every tick."""

    noise_across: Angle = Field(
        0.0, description="noise about each axis across the boresight, standard deviation, rad"
    )
    noise_about: Angle = Field(
        0.0, description="noise about the boresight, standard deviation, rad"
    )
    boresight: Annotated[
        list[float], Field(min_length=3, max_length=3), AfterValidator(has_direction)
    ] = Field([0.0, 0.0, 1.0], description="boresight in the base frame")
    rate: Annotated[float, Field(ge=0.0, le=1e5)] = Field(
        0.0,
        description="measurements per second, rounded to a whole number of ticks (0: one per tick)",
    )
    delay: Annotated[float, Field(ge=0.0, le=100.0)] = Field(
        0.0, description="time from exposure to output, s, rounded to a whole number of ticks"
    )
    step: Angle = Field(0.0, description="resolution of the attitude, rad (0: continuous)")
