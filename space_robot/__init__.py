"""A test bed for flight software of space robots: flights, campaigns, and what comes of them.

    import space_robot as sr

    flight = sr.Scenario(controller="tde_stc", case="3", sensors="fine").fly()
    sr.Campaign.load("my.yaml").run(runs=1000, seed=7, out="campaigns/a").verdicts
    sr.replay("flights/one").has_passed

The names below are the interface for people; they are imported when they are used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from space_robot_model.robot import Robot
    from space_robot_model.robot.dynamics import bias_force, forward_dynamics, mass_matrix

    from .analysis.load_bag import load_bag
    from .api import Bench, FlownFlight
    from .api.replayed import replay
    from .api.together import bench_many, fly_many
    from .campaign.flown import Campaign, FlownCampaign
    from .learning import make, make_vec
    from .scenario.disturbances import sampled
    from .scenario.scenario import Scenario

    __version__: str

__all__ = [
    "Bench",
    "Campaign",
    "FlownCampaign",
    "FlownFlight",
    "Robot",
    "Scenario",
    "bench_many",
    "bias_force",
    "fly_many",
    "forward_dynamics",
    "load_bag",
    "make",
    "make_vec",
    "mass_matrix",
    "replay",
    "sampled",
]
MODULES = {
    "Bench": "space_robot.api",
    "Campaign": "space_robot.campaign.flown",
    "FlownCampaign": "space_robot.campaign.flown",
    "FlownFlight": "space_robot.api",
    "Robot": "space_robot_model.robot",
    "Scenario": "space_robot.scenario.scenario",
    "bench_many": "space_robot.api.together",
    "bias_force": "space_robot_model.robot.dynamics",
    "fly_many": "space_robot.api.together",
    "forward_dynamics": "space_robot_model.robot.dynamics",
    "load_bag": "space_robot.analysis.load_bag",
    "make": "space_robot.learning",
    "make_vec": "space_robot.learning",
    "mass_matrix": "space_robot_model.robot.dynamics",
    "replay": "space_robot.api.replayed",
    "sampled": "space_robot.scenario.disturbances",
}
"""The module of each name."""


def __getattr__(name: str) -> Any:
    """Import a public name at its first use: commands that need none of them start sooner."""
    if name == "__version__":
        from .processes.software import installed_version

        return installed_version(__name__) or "unknown"
    if name not in MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(MODULES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
