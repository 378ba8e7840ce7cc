"""Environment variables that every ROS process of this project has unless the user set others."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path

RANGE, PROFILES = "ROS_AUTOMATIC_DISCOVERY_RANGE", "FASTRTPS_DEFAULT_PROFILES_FILE"
THIS_MACHINE = str(Path(__file__).with_name("fastdds_localhost.xml"))
"""Fast DDS on 127.0.0.1 alone, by UDP; and what `ANY_RANGE` has."""
ANY_RANGE = str(Path(__file__).with_name("fastdds_profiles.xml"))
"""Settings of Fast DDS that leave discovery and transports as they are."""


def completed(given: Mapping[str, str]) -> dict[str, str]:
    """An environment with this project's defaults where the user left them open.

    Nothing leaves the machine unless the user asks: with a ``ROS_AUTOMATIC_DISCOVERY_RANGE`` that
    is not LOCALHOST, or static peers. LOCALHOST is `THIS_MACHINE` under Fast DDS: that of
    rmw_fastrtps listens on every interface, and in shared memory that a killed process leaves
    half-made, which hangs the next one.
    """
    rmw = given.get("RMW_IMPLEMENTATION") or "rmw_fastrtps_cpp"
    profiles = given.get(PROFILES, THIS_MACHINE)
    if profiles not in (ANY_RANGE, THIS_MACHINE) or not rmw.startswith("rmw_fastrtps"):
        return {RANGE: "LOCALHOST", **given}
    wanted = given.get(RANGE, "LOCALHOST")
    if (wanted == "LOCALHOST" and not given.get("ROS_STATIC_PEERS")) or (
        wanted == "SYSTEM_DEFAULT" and given.get(PROFILES) == THIS_MACHINE
    ):
        # SYSTEM_DEFAULT: rmw_fastrtps leaves transports and peers to the profile
        local = {RANGE: "SYSTEM_DEFAULT", PROFILES: THIS_MACHINE}
        if given.get("ROS_LOCALHOST_ONLY"):  # the range's predecessor, which would override it
            local["ROS_LOCALHOST_ONLY"] = "0"
        return {**given, **local}
    return {RANGE: "LOCALHOST", **given, PROFILES: ANY_RANGE}


def set_defaults() -> None:
    """Complete this process' environment; before rclpy is imported."""
    os.environ.update(completed(os.environ))
