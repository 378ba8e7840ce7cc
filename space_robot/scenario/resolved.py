"""The resolved scenario: every number of a flight, independent of files."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from pydantic import BaseModel

from space_robot_control.allocation.settings import AllocationSettings
from space_robot_control.controller.law_choice import NoLaw
from space_robot_control.controller.settings import DEFAULT, ControllerNodeSettings
from space_robot_control.guidance.mission import Mission, MissionNodeSettings, MissionSettings
from space_robot_control.laws import ControlLaw
from space_robot_model.hardware.base_actuators import BaseActuatorSettings, MagneticTorquerSettings
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_msgs_py.bag.recorder import RecorderNodeSettings
from space_robot_msgs_py.config.files import Tree
from space_robot_msgs_py.errors import InputError
from space_robot_sim.actuators.actuators import ActuatorSettings
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.disturbance_table import DisturbanceTable
from space_robot_sim.environment.environment import EnvironmentSettings
from space_robot_sim.environment.friction import coefficients
from space_robot_sim.environment.orbit import OrbitSettings
from space_robot_sim.faults.grammar import Fault
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.report import actuators, plant_description
from space_robot_sim.plant.settings import MOST_TICKS, PLANT_KINDS, PlantNodeSettings

from .faults import PROCESS_KINDS
from .node_settings import NODES, NOT_TO_BE_SET, FlightSettings
from .robots import Robots
from .scenario import Scenario

SECTIONS: Mapping[str, type[BaseModel]] = {
    "case": EnvironmentSettings,
    "sensors": SensorSettings,
    "actuators": ActuatorSettings,
    "orbit": OrbitSettings,
}
"""Options that hold numbers of the plant; an orbit only where there is one."""
BY_THE_MISSION = ("initial_joints_deg", "initial_quaternion", "initial_rate_deg_s")
"""Options that a mission sets for the plant."""
OF_PLANT = ("period", "substeps", "command_latency_ticks")
OF_THE_GRAPH = ("realtime", "paused", "fifo_priority")
"""Options of the plant's node; options of the graph only where they are set."""
OF_THE_CODE = ("controller_code", "shadow")
"""Parameters of the controller's node that change no number; options only where they are set."""
ROBOTS = ("robot", "plant_robot")
"""Options recorded in a bag as ``robot_file`` and ``controller_robot_file``."""
LABELS = (
    *("robot", "mission", "case", "sensors", "actuators", "orbit", "gains"),
    "navigation_sensors",
)
"""Names of files, which the numbers replace."""


@dataclass(frozen=True)
class ResolvedScenario:
    """Complete definition of a flight, made by `space_robot.scenario.resolve.resolve`.

    The settings are decisive, not the options: single parameters override options.
    """

    options: Scenario
    """Options as the user wrote them."""
    settings: FlightSettings
    """Settings of every node."""
    mission_name: str
    """Name of the mission's file; the robot's name if the mission belongs to the robot."""
    robots: Robots
    """Robot of the plant, and robot assumed by the flight software."""
    reference: Mission
    """Desired motion of joints and base."""
    laws: Mapping[str, ControlLaw]
    """All laws of the gain set, by name; the first is in force at the start."""
    swaps: list[tuple[int, ControlLaw]]
    """Ticks, and the law in force from each."""
    assumed_actuators: BaseActuatorSettings
    """The base's actuators as the flight software knows them."""
    process_faults: list[Fault]
    """Faults of the nodes' processes; faults of the plant are in its settings."""

    @property
    def plant(self) -> PlantNodeSettings:
        """The settings of the plant's node."""
        return self.settings.plant

    @property
    def controller(self) -> ControllerNodeSettings:
        """The settings of the controller's node."""
        return self.settings.controller

    @property
    def mission(self) -> MissionNodeSettings:
        """The settings of the mission's node."""
        return self.settings.mission

    @property
    def recorder(self) -> RecorderNodeSettings:
        """The settings of the recorder's node."""
        return self.settings.recorder

    @property
    def law(self) -> ControlLaw:
        """Law in force at the start."""
        return next(iter(self.laws.values()))

    @property
    def gains_used(self) -> dict[str, list[float]]:
        """Gains of the law in force at the start, one value per axis."""
        return {name: row.tolist() for name, row in self.law.gain_values.items()}

    @property
    def own_gains(self) -> list[str]:
        """Gains that the user set beside those of the set, as ``<law>.<gain>``."""
        return [
            f"{law}.{gain}"
            for law, gains in self.settings.gains.items()
            if law in self.laws
            for gain in gains
        ]

    @property
    def has_chosen_gains(self) -> bool:
        """True unless the gains are the default set's."""
        return self.controller.gains != DEFAULT or bool(self.settings.gains)

    @cached_property
    def parameters(self) -> dict[str, dict[str, Any]]:
        """The parameters of every node over its files, by dotted name."""
        return self.settings.parameters(self.laws)

    @property
    def ticks(self) -> int:
        """Number of ticks of the flight.

        Raises:
            InputError: the flight is too long, or the mission has no segments.
        """
        duration, period = self.options.duration, self.plant.period
        if duration is None:
            duration = self.reference.duration
        if duration <= 0.0:
            raise InputError("the mission has no segments: give a duration")
        ticks = max(1, math.floor(duration / period + 1e-6))
        if ticks > MOST_TICKS:
            raise InputError(
                f"duration must be at most {MOST_TICKS * period:g} s "
                f"({MOST_TICKS} ticks of {period:g} s), got {duration:g} s"
            )
        return ticks

    @property
    def faults(self) -> list[str]:
        """The texts of all faults."""
        in_plant = [text for text in self.plant.faults if text.strip()]
        if in_plant == self.options.faults_of(PLANT_KINDS):
            return self.options.faults
        return [*in_plant, *self.options.faults_of(PROCESS_KINDS)]

    @property
    def swap_texts(self) -> list[str]:
        """Return the swaps of laws as they are written."""
        return [text for text in self.controller.swaps if text.strip()]

    @property
    def has_friction(self) -> bool:
        """True if the joints have friction."""
        return bool(coefficients(self.robots.plant, self.plant.friction).any())

    @cached_property
    def tree(self) -> dict[str, Any]:
        """The options with every number, as plain mappings, lists and texts.

        It is a mapping of options as `Scenario` takes them, so that a printed one can be flown.
        Equal trees fly equal bits.
        """
        return _tree(self)

    def description(self, plant: Plant) -> dict[str, Any]:
        """Return the description kept in a bag, sufficient to repeat the flight.

        Args:
            plant: made from it.
        """
        robots, controller = self.robots.description, self.controller
        assumed = actuators(self.assumed_actuators)
        is_other = self.plant.base_actuation != "ideal" and assumed != actuators(self.plant)
        numbers = controller.filter_settings
        return {
            "controller": self.law.name,
            **plant_description(self.robots.plant, robots["robot_file"], plant, self.plant),
            **({"controller_base_actuators": assumed} if is_other else {}),
            "gains": controller.gains,
            **({"own_gains": self.own_gains} if self.own_gains else {}),
            "mission": self.mission_name,
            "ticks": self.ticks,
            **(
                {"navigation": "filtered", "navigation_filter": numbers.model_dump()}
                if numbers
                else {}
            ),
            **({"faults": self.faults} if self.faults else {}),
            **({"swaps": self.swap_texts} if self.swap_texts else {}),
            **({"restart_controller": True} if self.options.restart_controller else {}),
            **({"without": list(self.options.without)} if self.options.without else {}),
            "parameters": self.parameters,
            "scenario": {k: v for k, v in self.tree.items() if k not in ROBOTS},
            "gains_used": self.gains_used,
            **robots,
        }


def _tree(scenario: ResolvedScenario) -> dict[str, Any]:
    settings, laws = scenario.settings, scenario.laws
    plant, controller = settings.plant, settings.controller
    numbers = _numbers(plant)
    sections = {
        option: {k: numbers[k] for k in schema.model_fields if k not in _ELSEWHERE and k in numbers}
        for option, schema in SECTIONS.items()
        if option != "orbit" or plant.has_orbit
    }
    disturbance: Tree = {}
    if text := sections["case"]["disturbance"].pop("table", ""):
        disturbance = {"disturbance": DisturbanceTable.parse(text).columns}
    of_mission = {*MissionSettings.model_fields}
    if not scenario.reference.uses_orbit:
        of_mission.remove("assumed_orbit")
    mission = _without_defaults(settings.mission.model_dump(mode="json", include=of_mission))
    navigation: Tree = {}
    if (filtered := controller.filter_settings) is not None:
        navigation = {"navigation_filter": filtered.model_dump(mode="json")}
    own = _numbers(scenario.assumed_actuators)
    differs = own != {key: sections["actuators"].get(key) for key in own}
    events = [text for text in plant.events if text.strip()]
    return {
        "controller": controller.controller,
        "gains": {
            name: {gain: values.tolist() for gain, values in law.gain_values.items()}
            for name, law in laws.items()
            if name != NoLaw.name and law.gain_values
        },
        **scenario.robots.options,
        "mission": {**mission, **_some(numbers, BY_THE_MISSION)},
        "events": events,
        **sections,
        **disturbance,
        **({"assumed_actuators": own} if differs else {}),
        "duration": scenario.ticks * plant.period,
        **{name: numbers[name] for name in OF_PLANT},
        "navigation": controller.navigation,
        "seed": plant.fault_seed,
        **({"faults": list(scenario.faults)} if scenario.faults else {}),
        **({"swaps": scenario.swap_texts} if scenario.swap_texts else {}),
        **{name: numbers[name] for name in OF_THE_GRAPH if numbers[name]},
        **{
            name: getattr(controller, name)
            for name in OF_THE_CODE
            if getattr(controller, name) != ControllerNodeSettings.model_fields[name].default
        },
        **({"restart_controller": True} if scenario.options.restart_controller else {}),
        **({"without": list(scenario.options.without)} if scenario.options.without else {}),
        "parameters": {
            node: {
                **_rest(node, getattr(settings, node)),
                **(navigation if node == "controller" else {}),
            }
            for node in NODES
        },
    }


def _some(numbers: Tree, keys: Iterable[str]) -> Tree:
    return {key: numbers[key] for key in keys if key in numbers}


_ELSEWHERE = ("events", *OF_PLANT)


def _rest(node: str, settings: BaseModel) -> dict[str, Any]:
    """Settings of a node that are not in another option of the tree."""
    held = {
        *(key for schema in SECTIONS.values() for key in schema.model_fields),
        *MissionSettings.model_fields,
        *BY_THE_MISSION,
        *OF_PLANT,
        *OF_THE_GRAPH,
        *OF_THE_CODE,
        *LABELS,
        "controller",
        "swaps",
        "navigation",
        "navigation_filter",
        "faults",
        "fault_seed",
        *(name.partition(".")[2] for name in NOT_TO_BE_SET if name.startswith(f"{node}.")),
    }
    return {key: value for key, value in _numbers(settings).items() if key not in held}


_LATER: Mapping[str, Any] = {
    "base_topics_rate": PlantNodeSettings.model_fields["base_topics_rate"].default,
    "initial_rate_deg_s": [0.0, 0.0, 0.0],
    "base_rate_deg_s": [0.0, 0.0, 0.0],
    "base_point": "",
    "magnetic_torquers": MagneticTorquerSettings().model_dump(mode="json"),
    **{key: AllocationSettings.model_fields[key].default for key in ("dump", "magnetic_gain")},
    **{key: DisturbanceSettings.model_fields[key].default for key in ("table", "table_scale")},
}
"""Settings that flights of earlier releases did not have, with their defaults. At these they are
left out, so that the digest of a flight without them stays."""


def _numbers(settings: BaseModel) -> Tree:
    return _without_defaults(settings.model_dump(mode="json"))


def _without_defaults(tree: Tree) -> Tree:
    return {
        key: _without_defaults(value) if isinstance(value, dict) else value
        for key, value in tree.items()
        if key not in _LATER or value != _LATER[key]
    }
