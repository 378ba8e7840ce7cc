"""Settings of the navigation filter."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel

Mode = Literal["direct", "filtered"]

Sigma = Annotated[float, Field(gt=0.0, le=1e3)]
Corner = Annotated[float, Field(ge=0.0, le=1e5)]


class NavigationFilterSettings(StrictModel):
    """The sensors as the filter believes them to be, and how much it smooths."""

    tracker_across: Sigma = Field(
        1e-5, description="star tracker's noise about each axis across the boresight, rad"
    )
    tracker_about: Sigma = Field(8e-5, description="its noise about the boresight, rad")
    tracker_boresight: Annotated[list[float], Field(min_length=3, max_length=3)] = Field(
        [0.0, 0.0, 1.0], description="its boresight in the base frame"
    )
    tracker_delay: Annotated[float, Field(ge=0.0, le=100.0)] = Field(
        0.1, description="time from its measurement to the report, s"
    )
    gyro_angle_walk: Sigma = Field(3e-7, description="gyro's angle random walk, rad/s^1/2")
    gyro_rate_walk: Annotated[float, Field(ge=0.0, le=1e3)] = Field(
        1e-9, description="gyro's rate random walk, rad/s^3/2"
    )
    gyro_bias: Sigma = Field(
        1e-6, description="standard deviation of the gyro's bias at the beginning, rad/s"
    )
    gate: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        10.0, description="standard deviations beyond which a tracker is not believed (0: none)"
    )
    rate_filter_hz: Corner = Field(
        100.0, description="corner of each of two low-passes of the base's rate, Hz (0: none)"
    )
    joint_angle_noise: Sigma = Field(1e-7, description="noise of a joint's angle, rad")
    joint_rate_noise: Annotated[float, Field(ge=0.0, le=1e3)] = Field(
        0.0,
        description="noise of a joint's rate, rad/s (0: it is differenced, so not used)",
    )
    joint_bandwidth_hz: Corner = Field(
        150.0, description="bandwidth of the filter of joint angles and rates, Hz (0: none)"
    )
