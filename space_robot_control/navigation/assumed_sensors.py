"""Default filter parameters, derived from the sensors' file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from space_robot_model.elementary.matrices import norm
from space_robot_model.hardware.sensors import (
    EncoderSettings,
    GyroSettings,
    SensorSettings,
    StarTrackerSettings,
)
from space_robot_model.hardware.sheets import read_sheet

from .settings import NavigationFilterSettings

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
"""Numbers of which 0 says something; where it would say that something is perfect, it counts as
not given."""
UNIFORM = 1.0 / math.sqrt(12.0)
"""Standard deviation of the error of rounding to steps of 1."""


def completed(
    settings: NavigationFilterSettings, sensors: str, period: float
) -> NavigationFilterSettings:
    """Return the settings with missing numbers filled from the sensors.

    Args:
        settings: as they were given.
        sensors: a name in config/sensors, or a path; read only where a number lacks.
        period: s.

    Raises:
        InputError: there is no such file, or it is wrong.
    """
    numbers = settings.model_dump()
    lacking = [name for name, value in numbers.items() if not _is_given(name, value)]
    if not lacking:
        return settings
    assumed = assumed_numbers(read_sheet(SensorSettings, "sensors", sensors), period)
    return settings.model_copy(update={name: assumed[name] for name in lacking})


def assumed_numbers(sensors: SensorSettings, period: float) -> Mapping[str, Any]:
    """Return the filter parameters for ``sensors``, by the names of its settings."""
    return {
        **_of_tracker(sensors.star_tracker),
        **_of_gyro(sensors.gyro, period),
        **_of_encoders(sensors.encoders),
    }


def _of_tracker(tracker: StarTrackerSettings) -> dict[str, Any]:
    rounding = UNIFORM * tracker.step
    return {
        "tracker_across": max(LEAST_ANGLE, norm((tracker.noise_across, rounding))),
        "tracker_about": max(LEAST_ANGLE, norm((tracker.noise_about, rounding))),
        "tracker_boresight": list(tracker.boresight),
        "tracker_delay": tracker.delay,
    }


def _of_gyro(gyro: GyroSettings, period: float) -> dict[str, Any]:
    """Return the gyro noise, with sample noise as an equivalent angle random walk."""
    sample = norm((gyro.noise, UNIFORM * gyro.step)) * math.sqrt(period)
    return {
        "gyro_angle_walk": max(LEAST, norm((gyro.angle_random_walk, sample))),
        "gyro_rate_walk": gyro.rate_random_walk,
        "gyro_bias": max(LEAST, *(abs(bias) for bias in gyro.initial_bias)),
    }


def _of_encoders(encoders: EncoderSettings) -> dict[str, Any]:
    """Return the encoder noise; differenced rates have the noise of the angles."""
    step = 2.0 * math.pi / 2.0**encoders.bits if encoders.bits else 0.0
    rate = norm((encoders.velocity_noise, UNIFORM * encoders.velocity_step))
    return {
        "joint_angle_noise": max(LEAST, norm((encoders.noise, UNIFORM * step))),
        "joint_rate_noise": 0.0 if encoders.difference_ticks else max(LEAST, rate),
    }


def _is_given(name: str, value: float | list[float]) -> bool:
    if isinstance(value, list):
        return any(value)
    return value > 0.0 or (value == 0.0 and name in MAY_BE_ZERO)
