"""A test bed for flight software of space robots: flights, campaigns, and what comes of them.

    import space_robot as sr

    flight = sr.Scenario(controller="tde_stc", case="3", sensors="fine").fly()
    flight.metrics["joints_1_3.rms"], flight.plot(), flight.view()
    sr.Campaign.load("my.yaml").run(runs=1000, seed=7, out="campaigns/a").verdicts
    sr.replay("flights/one").has_passed

| name | what it is |
|---|---|
| `Scenario` | robot, mission, law, gains, sensors, faults: what `fly` takes, and `Scenario.bench` |
| `FlownFlight` | a flight: `log`, `metrics`, `report`, `table`, `plot`, `view`, `save` |
| `fly_many`, `bench_many` | many scenarios at once, eight in the lanes of a processor |
| `Bench` | a flight step by step, under torques of your own |
| `load_bag` | a recorded flight as arrays, for `space_robot.analysis.analyze` and `measure` |
| `replay` | the recorded states once more, answered by flight software and compared |
| `Campaign`, `FlownCampaign` | flights with drawn parameters, and verdicts on requirements |
| `make`, `make_vec` | environments of Gymnasium, for learning |
| `Robot` | links, joints, masses, of YAML or URDF |
| `mass_matrix`, `bias_force`, `forward_dynamics` | the dynamics of a `Robot` |
| `sampled` | a disturbance as a function of time, for `Scenario` |

These names are the interface for people; they are imported when they are used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from space_robot_model.robot import Robot
    from space_robot_model.robot.dynamics import bias_force, forward_dynamics, mass_matrix

    from .analysis.analysed_log import load_bag
    from .api import Bench, FlownFlight, Scenario
    from .api.fly_many import bench_many, fly_many
    from .campaign.flown import Campaign, FlownCampaign
    from .flight.replay.run import replay
    from .learning import make, make_vec
    from .scenario.objects import sampled

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
    "Scenario": "space_robot.api",
    "bench_many": "space_robot.api.fly_many",
    "bias_force": "space_robot_model.robot.dynamics",
    "fly_many": "space_robot.api.fly_many",
    "forward_dynamics": "space_robot_model.robot.dynamics",
    "load_bag": "space_robot.analysis.analysed_log",
    "make": "space_robot.learning",
    "make_vec": "space_robot.learning",
    "mass_matrix": "space_robot_model.robot.dynamics",
    "replay": "space_robot.flight.replay.run",
    "sampled": "space_robot.scenario.objects",
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
