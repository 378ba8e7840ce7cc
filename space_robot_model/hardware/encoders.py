"""The data sheet of joint encoders."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel

Sigma = Annotated[float, Field(ge=0.0, le=1e3)]

MOST_DIFFERENCED = 256
"""Maximum number of ticks over which a rate is differenced."""


class EncoderSettings(StrictModel):
    """Encoders of all joints; by default without error."""

    bits: Annotated[int, Field(ge=0, le=32)] = Field(
        0, description="resolution: 2^bits steps per revolution, or per metre (0: continuous)"
    )
    noise: Sigma = Field(0.0, description="white noise of each angle, rad or m")
    difference_ticks: Annotated[int, Field(ge=0, le=MOST_DIFFERENCED)] = Field(
        0,
        description="ticks over which angles are differenced to joint rates (0: rates are "
        "measured)",
    )
    velocity_noise: Sigma = Field(0.0, description="white noise of each joint rate, rad/s or m/s")
    velocity_step: Sigma = Field(
        0.0, description="resolution of joint rates, rad/s or m/s (0: continuous)"
    )
