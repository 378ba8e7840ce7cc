"""The flight software: control laws, controller, mission, and how flights are flown and judged.

One flight, many, and one again:

    from space_robot_control import Campaign, Scenario, replay

    flight = Scenario(controller="tde_stc", case="3", sensors="fine").fly()
    Campaign.load("my.yaml").run(runs=1000, seed=7, out="campaigns/a").verdicts
    replay("flights/one").has_passed
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .campaign.flown import Campaign, FlownCampaign
    from .scenario import Bench, FlownFlight, Scenario
    from .scenario.replayed import replay

__all__ = ["Bench", "Campaign", "FlownCampaign", "FlownFlight", "Scenario", "replay"]
ROOMS = {
    "Campaign": ".campaign.flown",
    "FlownCampaign": ".campaign.flown",
    "replay": ".scenario.replayed",
}
"""Of names that are not in ``.scenario``."""


def __getattr__(name: str) -> Any:
    """Import what is asked for only then: commands that need none of it start sooner."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(ROOMS.get(name, ".scenario"), __name__), name)
