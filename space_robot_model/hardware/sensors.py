"""Data sheets of the sensors; by default each is without error."""

from __future__ import annotations

from typing import Annotated

from pydantic import AfterValidator, Field

from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError

from ..elementary.matrices import direction_norm

Angle = Annotated[float, Field(ge=0.0, le=1.0)]
Sigma = Annotated[float, Field(ge=0.0, le=1e3)]
OnAxes = Annotated[
    list[Annotated[float, Field(ge=-10.0, le=10.0)]], Field(min_length=3, max_length=3)
]
Tesla = Annotated[float, Field(ge=-1.0, le=1.0)]

LEAST_RATE = 1e-6
"""Smallest rate of a star tracker, Hz: one measurement in eleven days."""
MOST_UNDER_WAY = 64
"""Maximum number of a star tracker's measurements that are not released yet."""
MOST_DIFFERENCED = 256
"""Maximum number of ticks over which an encoder's rate is differenced."""


def check_direction(vector: list[float]) -> list[float]:
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
        list[float], Field(min_length=3, max_length=3), AfterValidator(check_direction)
    ] = Field([0.0, 0.0, 1.0], description="boresight in the base frame")
    rate: Annotated[float, Field(ge=0.0, le=1e5)] = Field(
        0.0,
        description="measurements per second, rounded to a whole number of ticks (0: one per tick)",
    )
    delay: Annotated[float, Field(ge=0.0, le=100.0)] = Field(
        0.0, description="time from exposure to output, s, rounded to a whole number of ticks"
    )
    step: Angle = Field(0.0, description="resolution of the attitude, rad (0: continuous)")

    def ticks(self, period: float) -> tuple[int, int]:
        """Return interval and delay of the measurements in ticks of ``period`` seconds.

        Raises:
            InputError: rate and delay do not fit one another or the period.
        """
        if 0.0 < self.rate < LEAST_RATE:
            raise InputError(
                f"star_tracker.rate must be 0 (a measurement every tick) or at least "
                f"{LEAST_RATE:g} Hz, got {self.rate:g}"
            )
        if self.rate * period > 1.0 + 1e-9:
            raise InputError(
                f"star_tracker.rate must be at most one measurement a tick, "
                f"{1.0 / period:g} Hz, got {self.rate:g}"
            )
        # exposures fall on ticks: the plant knows its state nowhere else
        interval = max(1, round(1.0 / (self.rate * period))) if self.rate else 1
        delay = round(self.delay / period)
        if delay // interval >= MOST_UNDER_WAY:
            raise InputError(
                f"star_tracker.delay holds {delay // interval} measurements, "
                f"at most {MOST_UNDER_WAY - 1} can be under way: measure at a lower rate"
            )
        return interval, delay


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

    def step(self, whole: float) -> float:
        """Return the distance of two angles if ``whole`` is a revolution (0: continuous)."""
        return whole / 2.0**self.bits if self.bits else 0.0


class MagnetometerSettings(StrictModel):
    """A magnetometer, which magnetic torquers need; by default without error."""

    noise: Annotated[float, Field(ge=0.0, le=1.0)] = Field(
        0.0, description="white noise of each sample, T"
    )
    bias: Annotated[list[Tesla], Field(min_length=3, max_length=3)] = Field(
        [0.0, 0.0, 0.0], description="constant bias on base x, y, z, T"
    )


class SensorSettings(StrictModel):
    """Settings of all sensors."""

    star_tracker: StarTrackerSettings = StarTrackerSettings()
    gyro: GyroSettings = GyroSettings()
    encoders: EncoderSettings = EncoderSettings()
    magnetometer: MagnetometerSettings = MagnetometerSettings()
