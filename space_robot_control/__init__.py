"""Flight software: control laws, controller, navigation, allocation and guidance."""

from __future__ import annotations

from space_robot_msgs_py.deprecation import moved_names

__getattr__ = moved_names(
    __name__,
    {
        name: "space_robot"
        for name in ("Bench", "Campaign", "FlownCampaign", "FlownFlight", "Scenario", "replay")
    },
)
