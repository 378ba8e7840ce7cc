"""The data sheets of all sensors."""

from __future__ import annotations

from space_robot_msgs_py.config.validation import StrictModel

from .encoders import EncoderSettings
from .gyro import GyroSettings
from .star_tracker import StarTrackerSettings


class SensorSettings(StrictModel):
    """Settings of all sensors."""

    star_tracker: StarTrackerSettings = StarTrackerSettings()
    gyro: GyroSettings = GyroSettings()
    encoders: EncoderSettings = EncoderSettings()
