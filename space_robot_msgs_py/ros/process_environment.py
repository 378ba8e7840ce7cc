"""Defaults of environment variables of this project's ROS processes; the user's have priority."""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import gettempdir

DEFAULTS = {
    # discovery stays on this machine
    "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
    # no shared memory; rmw_fastrtps 8.4 ignores this with LOCALHOST, so the profile selects UDP,
    # too
    "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
    "FASTRTPS_DEFAULT_PROFILES_FILE": str(Path(__file__).with_name("fastdds_profiles.xml")),
}


def defaults() -> dict[str, str]:
    """Return `DEFAULTS`, and a folder for ROS log files if the home folder cannot be used."""
    has_home = any(os.environ.get(name) for name in ("ROS_LOG_DIR", "ROS_HOME", "HOME"))
    folder = {} if has_home else {"ROS_LOG_DIR": str(Path(gettempdir(), f"ros_log_{os.getuid()}"))}
    return DEFAULTS | folder


def set_defaults() -> None:
    """Apply `defaults`; to be called before rclpy is imported."""
    for name, value in defaults().items():
        os.environ.setdefault(name, value)
