"""The data sheet of a gyro."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel

Sigma = Annotated[float, Field(ge=0.0, le=1e3)]
OnAxes = Annotated[
    list[Annotated[float, Field(ge=-10.0, le=10.0)]], Field(min_length=3, max_length=3)
]


class GyroSettings(StrictModel):
    """A gyro; by default without error."""

    noise: Sigma = Field(
        0.0, description="white noise of each sample, independent of the period, rad/s"
    )
    angle_random_walk: Sigma = Field(
        0.0, description="density sigma_v of the white noise on the rate, rad/s^1/2"
    )
    rate_random_walk: Sigma = Field(
        0.0, description="density sigma_u of the white noise that drives the bias, rad/s^3/2"
    )
    initial_bias: OnAxes = Field(
        [0.0, 0.0, 0.0], description="bias at tick 0 on base x, y, z, rad/s"
    )
    scale_factor_error: OnAxes = Field(
        [0.0, 0.0, 0.0],
        description="scale factor error e: the gyro measures (1 + e) times the rate; base x, y, z",
    )
    step: Sigma = Field(0.0, description="resolution, rad/s (0: continuous)")
