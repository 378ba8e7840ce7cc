"""Settings of navigation and its filter."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field

from space_robot_msgs_py.config.validation import StrictModel

Mode = Literal["direct", "filtered"]
AS_THE_SENSORS = -1.0
"""Value that selects the number of the sensors' own settings."""

LEAST_SIGMA = 1e-12
"""A noise above 0 that is smaller counts as this: the filter's numbers are of its square."""


def _no_smaller(sigma: float) -> float:
    return max(sigma, LEAST_SIGMA) if sigma > 0.0 else sigma


Sigma = Annotated[float, Field(ge=-1.0, le=1e3), AfterValidator(_no_smaller)]
Corner = Annotated[float, Field(ge=0.0, le=1e5)]


class NavigationFilterSettings(StrictModel):
    """The sensors as the filter believes them to be, and how much it smooths."""

    tracker_across: Sigma = Field(
        AS_THE_SENSORS,
        description="star tracker's noise about axes across the boresight, rad (-1: as the "
        "sensors)",
    )
    tracker_about: Sigma = Field(
        AS_THE_SENSORS,
        description="star tracker's noise about the boresight, rad (-1: as the sensors)",
    )
    tracker_boresight: Annotated[list[float], Field(min_length=3, max_length=3)] = Field(
        [0.0, 0.0, 0.0],
        description="star tracker's boresight in the base frame (0, 0, 0: as the sensors)",
    )
    tracker_delay: Annotated[float, Field(ge=-1.0, le=2.0)] = Field(
        AS_THE_SENSORS,
        description="star tracker's delay from measurement to report, s (-1: as the sensors)",
    )
    gyro_angle_walk: Sigma = Field(
        AS_THE_SENSORS, description="gyro's angle random walk, rad/s^1/2 (-1: as the sensors)"
    )
    gyro_rate_walk: Sigma = Field(
        AS_THE_SENSORS, description="gyro's rate random walk, rad/s^3/2 (-1: as the sensors)"
    )
    gyro_bias: Sigma = Field(
        AS_THE_SENSORS,
        description="standard deviation of the gyro's initial bias, rad/s (-1: as the sensors)",
    )
    gate: Annotated[float, Field(ge=0.0, le=1e6)] = Field(
        10.0,
        description="gate of the star tracker: measurements farther off are rejected, standard "
        "deviations (0: none)",
    )
    rate_filter_hz: Corner = Field(
        100.0,
        description="corner frequency of each of the two low-pass filters of the base's rate, Hz "
        "(0: none)",
    )
    joint_angle_noise: Sigma = Field(
        AS_THE_SENSORS, description="noise of a joint's angle, rad or m (-1: as the sensors)"
    )
    joint_rate_noise: Sigma = Field(
        AS_THE_SENSORS,
        description="noise of a joint's rate, rad/s or m/s (0: not used; -1: as the sensors)",
    )
    joint_bandwidth_hz: Corner = Field(
        150.0, description="bandwidth of the filter of joint angles and rates, Hz (0: none)"
    )
