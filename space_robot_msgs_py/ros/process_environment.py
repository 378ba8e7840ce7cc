"""Environment variables that every ROS process of this project has unless the user set them."""

from __future__ import annotations

import os

DEFAULTS = {
    # discovery stays on this machine
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    # a killed process leaves half-made shared memory behind that hangs the next one
    "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
}


def set_defaults() -> None:
    """Apply `DEFAULTS`; before rclpy is imported."""
    for name, value in DEFAULTS.items():
        os.environ.setdefault(name, value)
