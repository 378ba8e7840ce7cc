"""The resolved scenario: the tree of options with every number in it and no file left to read.

It is a mapping of options as `FlightPlan` takes them, so that a printed one can be flown. Equal
trees fly equal bits.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from pydantic import BaseModel

from space_robot_control.controller.plain_laws import NoLaw
from space_robot_control.guidance.mission import MissionSettings
from space_robot_control.laws import ControlLaw
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_msgs_py.config.trees import Tree
from space_robot_sim.actuators.actuators import ActuatorSettings
from space_robot_sim.environment.environment import EnvironmentSettings

from .node_settings import NODES, NOT_TO_BE_SET, FlightSettings
from .options import FlightPlan
from .robots import Robots

SECTIONS: Mapping[str, type[BaseModel]] = {
    "case": EnvironmentSettings,
    "sensors": SensorSettings,
    "actuators": ActuatorSettings,
}
"""Options that hold numbers of the plant."""
BY_THE_MISSION = ("initial_joints_deg", "initial_quaternion")
"""What a mission says to the plant."""
OF_PLANT = ("period", "substeps", "command_latency_ticks")
OF_THE_GRAPH = ("realtime", "paused", "fifo_priority")
"""Options of the plant's node; those of the graph only where they are set."""
ROBOTS = ("robot", "plant_robot")
"""Options that a bag tells as ``robot_file`` and ``controller_robot_file``."""
LABELS = ("robot", "mission", "case", "sensors", "actuators", "gains", "navigation_sensors")
"""Names of files, which the numbers replace."""


def resolved_options(
    plan: FlightPlan,
    settings: FlightSettings,
    robots: Robots,
    laws: Mapping[str, ControlLaw],
    assumed: BaseActuatorSettings,
    ticks: int,
    faults: Sequence[str],
) -> dict[str, Any]:
    """Return the options of a flight with every number, as plain mappings, lists and texts.

    Args:
        plan: as the user wrote it.
        settings: of the nodes.
        robots: of plant and flight software.
        laws: that can be flown, by name.
        assumed: what the flight software assumes of the base's actuators.
        ticks: of the flight.
        faults: the texts of all of them.
    """
    plant, controller = settings.plant, settings.controller
    numbers = plant.model_dump(mode="json")
    sections = {
        option: {key: numbers[key] for key in schema.model_fields if key not in _ELSEWHERE}
        for option, schema in SECTIONS.items()
    }
    mission = settings.mission.model_dump(mode="json", include=set(MissionSettings.model_fields))
    navigation: Tree = {}
    if (filtered := controller.filter_settings) is not None:
        navigation = {"navigation_filter": filtered.model_dump(mode="json")}
    own = assumed.model_dump(mode="json")
    differs = own != {key: sections["actuators"][key] for key in own}
    swaps = [text for text in controller.swaps if text.strip()]
    events = [text for text in plant.events if text.strip()]
    return {
        "controller": controller.controller,
        "gains": {
            name: {gain: values.tolist() for gain, values in law.gain_values.items()}
            for name, law in laws.items()
            if name != NoLaw.name and law.gain_values
        },
        **robots.options,
        "mission": {**mission, **{name: numbers[name] for name in BY_THE_MISSION}},
        "events": events,
        **sections,
        **({"assumed_actuators": own} if differs else {}),
        "duration": ticks * plant.period,
        **{name: numbers[name] for name in OF_PLANT},
        "navigation": controller.navigation,
        "seed": plant.fault_seed,
        **({"faults": list(faults)} if faults else {}),
        **({"swaps": swaps} if swaps else {}),
        **{name: numbers[name] for name in OF_THE_GRAPH if numbers[name]},
        **({"restart_controller": True} if plan.restart_controller else {}),
        "parameters": {
            node: {
                **_rest(node, getattr(settings, node)),
                **(navigation if node == "controller" else {}),
            }
            for node in NODES
        },
    }


_ELSEWHERE = ("events", *OF_PLANT)


def _rest(node: str, settings: BaseModel) -> dict[str, Any]:
    """The settings of a node that no other option of the tree holds."""
    held = {
        *(key for schema in SECTIONS.values() for key in schema.model_fields),
        *MissionSettings.model_fields,
        *BY_THE_MISSION,
        *OF_PLANT,
        *OF_THE_GRAPH,
        *LABELS,
        "controller",
        "swaps",
        "navigation",
        "navigation_filter",
        "faults",
        "fault_seed",
        *(name.partition(".")[2] for name in NOT_TO_BE_SET if name.startswith(f"{node}.")),
    }
    return {key: v for key, v in settings.model_dump(mode="json").items() if key not in held}
