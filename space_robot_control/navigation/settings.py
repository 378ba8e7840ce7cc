"""Settings of navigation: the sensors that the filter assumes, and its smoothing."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field

from space_robot_model.elementary.matrices import norm
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_model.hardware.sheets import read_sheet
from space_robot_msgs_py.config.validation import StrictModel

NavigationMode = Literal["direct", "filtered"]
AS_THE_SENSORS = -1.0
"""Value that selects the number of the sensors' own settings."""

LEAST_ANGLE = 1e-7
"""rad; no tracker is assumed to be better, for nothing else in the filter is that exact."""
LEAST = 1e-9
"""No gyro and no encoder is assumed to be better, rad and rad/s."""
MAY_BE_ZERO = (
    "tracker_delay",
    "gyro_rate_walk",
    "joint_rate_noise",
    "gate",
    "rate_filter_hz",
    "joint_bandwidth_hz",
)
"""Numbers that may be 0: none, or off. Of the others 0 would be a perfect sensor: not given."""
UNIFORM = 1.0 / math.sqrt(12.0)
"""Standard deviation of the error of rounding to steps of 1."""
LEAST_SIGMA = 1e-12
"""A noise above 0 that is smaller counts as this: the filter's numbers are of its square."""


def _no_smaller(sigma: float) -> float:
    return max(sigma, LEAST_SIGMA) if sigma > 0.0 else sigma


Sigma = Annotated[float, Field(ge=-1.0, le=1e3), AfterValidator(_no_smaller)]
Corner = Annotated[float, Field(ge=0.0, le=1e5)]


class NavigationFilterSettings(StrictModel):
    """The sensors that the filter assumes, and how much it smooths."""

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


def completed(
    settings: NavigationFilterSettings, sensors: str, period: float
) -> NavigationFilterSettings:
    """Return the settings with missing numbers filled from the sensors.

    Args:
        settings: as they were given.
        sensors: a name in config/sensors, or a path; read only if a number is missing.
        period: s.
    """
    missing = [name for name, value in settings.model_dump().items() if not _is_given(name, value)]
    if not missing:
        return settings
    assumed = assumed_numbers(read_sheet(SensorSettings, "sensors", sensors), period)
    return settings.model_copy(update={name: assumed[name] for name in missing})


def assumed_numbers(sensors: SensorSettings, period: float) -> Mapping[str, Any]:
    """Return the filter parameters for ``sensors``, by the names of its settings.

    The noise of a gyro's samples counts as an equivalent angle random walk; rates that encoders
    difference have the noise of the angles.
    """
    tracker, gyro, encoders = sensors.star_tracker, sensors.gyro, sensors.encoders
    rounding = UNIFORM * tracker.step
    sample = norm((gyro.noise, UNIFORM * gyro.step)) * math.sqrt(period)
    # rounding to steps counts as white noise of their standard deviation
    angle_step = 2.0 * math.pi / 2.0**encoders.bits if encoders.bits else 0.0
    joint_rate = norm((encoders.velocity_noise, UNIFORM * encoders.velocity_step))
    return {
        "tracker_across": max(LEAST_ANGLE, norm((tracker.noise_across, rounding))),
        "tracker_about": max(LEAST_ANGLE, norm((tracker.noise_about, rounding))),
        "tracker_boresight": list(tracker.boresight),
        "tracker_delay": tracker.delay,
        "gyro_angle_walk": max(LEAST, norm((gyro.angle_random_walk, sample))),
        "gyro_rate_walk": gyro.rate_random_walk,
        "gyro_bias": max(LEAST, *(abs(bias) for bias in gyro.initial_bias)),
        "joint_angle_noise": max(LEAST, norm((encoders.noise, UNIFORM * angle_step))),
        "joint_rate_noise": 0.0 if encoders.difference_ticks else max(LEAST, joint_rate),
    }


def _is_given(name: str, value: float | list[float]) -> bool:
    if isinstance(value, list):
        return any(value)
    return value > 0.0 or (value == 0.0 and name in MAY_BE_ZERO)
