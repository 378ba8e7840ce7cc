"""/base/odometry, /base/imu, /base/wrench: the base in standard messages of one frame each."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from .. import topics
from ..samples import Timebase
from ..topics import Topic
from .poses import Array, NumbersCodec

UNKNOWN = [-1.0, *[0.0] * 8]
"""Covariance of what a sensor_msgs/Imu does not tell."""


class BaseMessages:
    """Encodes the messages of `topics.STANDARD`."""

    def __init__(self, timebase: Timebase, prefix: str = "") -> None:
        """``prefix``: of the base's frame, as in /tf (``sat1/``)."""
        base = {"header": {"frame_id": f"{prefix}{topics.BASE_FRAME}"}}
        self._odometry = NumbersCodec(
            topics.ODOMETRY.type,
            {
                "header": {"frame_id": topics.INERTIAL_FRAME},
                "child_frame_id": f"{prefix}{topics.BASE_FRAME}",
            },
            [("pose.pose.position", 7), ("twist.twist.linear", 6)],
            timebase,
        )
        self._imu = NumbersCodec(
            topics.IMU.type,
            {**base, "linear_acceleration_covariance": UNKNOWN},
            [("orientation", 4), ("angular_velocity", 3)],
            timebase,
        )
        self._wrench = NumbersCodec(topics.WRENCH.type, base, [("wrench.force", 6)], timebase)

    def encode(
        self, tick: int, pose: Array, twist: Array, wrench: Array
    ) -> Iterator[tuple[Topic, bytes]]:
        """Yield the messages of a tick.

        Args:
            tick: of their stamps.
            pose: (7,) position, m, and quaternion x, y, z, w of the base in the inertial frame.
            twist: (6,) linear (m/s), then angular (rad/s) velocity on base axes.
            wrench: (6,) force (N), then torque (N m) on base axes, about the base's origin.
        """
        yield topics.ODOMETRY, self._odometry.encode(tick, np.concatenate((pose, twist)))
        yield topics.IMU, self._imu.encode(tick, np.concatenate((pose[3:], twist[3:])))
        yield topics.WRENCH, self._wrench.encode(tick, wrench)
