"""The provenance of flights: commit, versions, parameters."""

from __future__ import annotations

import platform
from typing import Any

from ...flight.plan import Flight
from ...flight.software import commit, versions


def provenance() -> dict[str, Any]:
    """Return commit (None outside a checkout), versions, machine."""
    return {
        "commit": commit(),
        "versions": versions(),
        "machine": f"{platform.system()} {platform.machine()}",
    }


def parameters(flight: Flight) -> dict[str, Any]:
    """Return all that plant, controller and mission are told in a flight."""
    return {
        "period_s": flight.period,
        "plant": flight.plant_settings.model_dump(exclude={"mission", "wait_for"}),
        "gains": flight.gains_used,
        "mission": {
            "waypoint_times_s": flight.mission_settings.waypoint_times,
            "waypoints_deg": flight.mission_settings.waypoints_deg,
        },
    }
