"""Environment variables that every ROS process of this project has unless the user set them."""

from __future__ import annotations

import os
from pathlib import Path

DEFAULTS = {
    # discovery stays on this machine
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    # no shared memory, where the middleware obeys: rmw_fastrtps 8.4 with LOCALHOST does not, so
    # the profile keeps to UDP, too
    "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
    "FASTRTPS_DEFAULT_PROFILES_FILE": str(Path(__file__).with_name("fastdds_profiles.xml")),
}


def set_defaults() -> None:
    """Apply `DEFAULTS`; before rclpy is imported."""
    for name, value in DEFAULTS.items():
        os.environ.setdefault(name, value)
