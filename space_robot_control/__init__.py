"""The flight software: control laws, controller, mission, and how flights are flown and judged.

from space_robot_control import Scenario
flight = Scenario(controller="tde_stc", case="3", sensors="fine").fly()
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .scenario import Bench, FlownFlight, Scenario

__all__ = ["Bench", "FlownFlight", "Scenario"]


def __getattr__(name: str) -> Any:
    """Import what is asked for only then: commands that need none of it start sooner."""
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from . import scenario

    return getattr(scenario, name)
