"""The data sheet of joint encoders."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel

Sigma = Annotated[float, Field(ge=0.0, le=1e3)]

MOST_DIFFERENCED = 256
"""Ticks over which a rate can be differenced."""


class EncoderSettings(StrictModel):
    """The encoders of all joints; by default without error."""

    bits: Annotated[int, Field(ge=0, le=32)] = Field(
        0, description="steps of a turn, or of a metre, are two to this power (0: no steps)"
    )
    noise: Sigma = Field(0.0, description="white noise of each angle, rad or m")
    difference_ticks: Annotated[int, Field(ge=0, le=MOST_DIFFERENCED)] = Field(
        0, description="joint rates are differences of angles over so many ticks (0: measured)"
    )
    velocity_noise: Sigma = Field(0.0, description="white noise of each joint rate, rad/s or m/s")
    velocity_step: Sigma = Field(
        0.0, description="distance of two values of a joint rate, rad/s or m/s (0: none)"
    )
