"""The resolved scenario: every number of a flight, independent of files."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from operator import attrgetter
from typing import Any

from pydantic import BaseModel

from space_robot_control.controller.law_choice import NoLaw
from space_robot_control.controller.settings import DEFAULT
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_control.laws import ControlLaw
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_msgs_py.config.files import Tree, flatten
from space_robot_msgs_py.errors import InputError
from space_robot_sim.actuators.actuators import ActuatorSettings
from space_robot_sim.environment.disturbance_table import DisturbanceTable
from space_robot_sim.environment.environment import EnvironmentSettings
from space_robot_sim.environment.friction import coefficients
from space_robot_sim.environment.orbit import OrbitSettings
from space_robot_sim.faults.grammar import Fault
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.report import plant_description
from space_robot_sim.plant.settings import MOST_TICKS, PLANT_KINDS

from .faults import PROCESS_KINDS
from .node_settings import NODES, NOT_TO_BE_SET, SET_BY_OPTIONS, FlightSettings
from .options import OPTIONS
from .scenario import Scenario


@dataclass(frozen=True)
class ResolvedScenario(FlightSettings):
    """Complete definition of a flight, made by `space_robot.scenario.resolve.resolve`.

    The settings are decisive, not the options: single parameters override options.
    """

    options: Scenario
    """Options as the user wrote them."""
    mission_name: str
    """Name of the mission's file; the robot's name if the mission belongs to the robot."""
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
    def law(self) -> ControlLaw:
        """Law in force at the start."""
        return next(iter(self.laws.values()))

    @property
    def gains_used(self) -> dict[str, list[float]]:
        """Gains of the law in force at the start, one value per axis."""
        return {name: row.tolist() for name, row in self.law.given_gains.items()}

    @property
    def own_gains(self) -> list[str]:
        """Gains that the user set beside those of the set, as ``<law>.<gain>``."""
        return [
            f"{law}.{gain}"
            for law, gains in self.gains.items()
            if law in self.laws
            for gain in gains
        ]

    @property
    def has_chosen_gains(self) -> bool:
        """True unless the gains are the default set's."""
        return self.controller.gains != DEFAULT or bool(self.gains)

    @cached_property
    def parameters(self) -> dict[str, dict[str, Any]]:
        """All parameters of every node but those that the flight sets at its start, dotted."""
        parameters = {
            node: {
                name: value
                for name, value in flatten(getattr(self, node).model_dump(mode="json"))
                if f"{node}.{name}" not in NOT_TO_BE_SET or name in SET_BY_OPTIONS
            }
            for node in NODES
        }
        parameters["controller"] |= {
            f"{name}.{gain}": values.tolist()
            for name, law in self.laws.items()
            for gain, values in law.given_gains.items()
        }
        return parameters

    @property
    def ticks(self) -> int:
        """Number of ticks of the flight."""
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
        if in_plant == self.options.fault_texts(PLANT_KINDS):
            return self.options.faults
        return [*in_plant, *self.options.fault_texts(PROCESS_KINDS)]

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
        tree = {name: number(self) for name, number in ALWAYS_SHOWN.items()}
        options = {name: getattr(self.options, name) for name in OPTIONS.keys() - HIDDEN}
        optional = options | {name: number(self) for name, number in SHOWN_IF_SET.items()}
        return tree | {
            name: optional[name]
            for name, option in OPTIONS.items()
            if name not in ALWAYS_SHOWN and optional.get(name, option.default) != option.default
        }

    def brief(self, plant: Plant, robot_file: Mapping[str, Any]) -> dict[str, Any]:
        """Return what reports and metrics need of the `description`; much faster.

        Args:
            plant: made from it.
            robot_file: numbers of the plant's robot.
        """
        return {
            "controller": self.law.name,
            **plant_description(self.robots.plant, robot_file, plant, self.plant),
            "gains": self.controller.gains,
            **({"own_gains": self.own_gains} if self.own_gains else {}),
            "mission": self.mission_name,
            "ticks": self.ticks,
            "navigation": self.controller.navigation,
            **({"faults": self.faults} if self.faults else {}),
            **({"swaps": self.swap_texts} if self.swap_texts else {}),
            **({"restart_controller": True} if self.options.restart_controller else {}),
            **({"without": list(self.options.without)} if self.options.without else {}),
        }

    def description(self, plant: Plant) -> dict[str, Any]:
        """Return the description kept in a bag, sufficient to repeat the flight.

        ``plant``: made from it.
        """
        robots = self.robots.description
        return {
            **self.brief(plant, robots["robot_file"]),
            "scenario": {
                k: v for k, v in self.tree.items() if k not in ("robot", "plant_robot", *DOWNLINK)
            },
            **robots,
        }


def _gains(scenario: ResolvedScenario) -> Tree:
    return {
        name: {gain: values.tolist() for gain, values in law.given_gains.items()}
        for name, law in scenario.laws.items()
        if name != NoLaw.name and law.given_gains
    }


def _mission(scenario: ResolvedScenario) -> Tree:
    own = {*MissionSettings.model_fields}
    if not scenario.reference.uses_orbit:
        own.remove("assumed_orbit")
    start = scenario.plant.model_dump(mode="json", include={*START})
    return scenario.mission.model_dump(mode="json", include=own) | start


def _plant_numbers(schema: type[BaseModel], scenario: ResolvedScenario) -> Tree:
    own = {*schema.model_fields} - {"events", *SAME_IN_PLANT}
    table = {"disturbance": {"table"}}  # an option of its own
    return scenario.plant.model_dump(mode="json", include=own, exclude=table)


def _disturbance(scenario: ResolvedScenario) -> Tree | str:
    text = scenario.plant.disturbance.table
    return DisturbanceTable.parse(text).columns if text else ""


def _assumed_actuators(scenario: ResolvedScenario) -> Tree | None:
    assumed = scenario.assumed_actuators.model_dump(mode="json")
    true = scenario.plant.model_dump(mode="json", include={*assumed})
    return None if assumed == true else assumed


def _parameters(scenario: ResolvedScenario) -> dict[str, Tree]:
    parameters: dict[str, Tree] = {}
    for node in NODES:
        settings = getattr(scenario, node)
        at_start = {name.partition(".")[2] for name in NOT_TO_BE_SET if name.startswith(node)}
        parameters[node] = settings.model_dump(mode="json", exclude=HELD | at_start)
    if (filtered := scenario.controller.filter_settings) is not None:
        parameters["controller"]["navigation_filter"] = filtered.model_dump(mode="json")
    return parameters


SECTIONS: Mapping[str, type[BaseModel]] = {
    "case": EnvironmentSettings,
    "sensors": SensorSettings,
    "actuators": ActuatorSettings,
    "orbit": OrbitSettings,
}
"""Options that hold numbers of the plant."""
START = ("initial_joints_deg", "initial_quaternion", "initial_rate_deg_s")
"""Settings of the plant that its mission holds."""
SAME_IN_PLANT = ("period", "substeps", "command_latency_ticks")
DOWNLINK = ("telemetry", "telemetry_packets")
"""Options that a bag does not have: a flight that is repeated from it writes none."""
ALWAYS_SHOWN: Mapping[str, Callable[[ResolvedScenario], Any]] = {
    "controller": attrgetter("controller.controller"),
    "gains": _gains,
    "robot": lambda scenario: scenario.robots.options["robot"],
    "mission": _mission,
    "events": lambda scenario: [text for text in scenario.plant.events if text.strip()],
    **{name: partial(_plant_numbers, SECTIONS[name]) for name in ("case", "sensors", "actuators")},
    "duration": lambda scenario: scenario.ticks * scenario.plant.period,
    **{name: attrgetter(f"plant.{name}") for name in SAME_IN_PLANT},
    "navigation": attrgetter("controller.navigation"),
    "seed": attrgetter("plant.fault_seed"),
    "parameters": _parameters,
}
"""The resolved value of each option."""
SHOWN_IF_SET: Mapping[str, Callable[[ResolvedScenario], Any]] = {
    "plant_robot": lambda scenario: scenario.robots.options.get("plant_robot"),
    "orbit": lambda scenario: (
        _plant_numbers(OrbitSettings, scenario) if scenario.plant.has_orbit else "none"
    ),
    "disturbance": _disturbance,
    "assumed_actuators": _assumed_actuators,
    "faults": attrgetter("faults"),
    "swaps": attrgetter("swap_texts"),
    **{name: attrgetter(f"plant.{name}") for name in ("realtime", "paused", "fifo_priority")},
    **{name: attrgetter(f"controller.{name}") for name in ("controller_code", "shadow")},
    **{name: attrgetter(f"controller.{name}") for name in DOWNLINK},
}
"""Of options that are left out at their defaults; those not named here are as they were given."""
HIDDEN = {
    *("friction", "compression", "split_size"),  # in the case, and in the recorder's parameters
    *("namespace", "composed", "domain", "join_timeout"),  # where, and not what, is flown
    "telecommands",
}
HELD = {
    *(OPTIONS.keys() - HIDDEN),
    *(name for schema in SECTIONS.values() for name in schema.model_fields),
    *MissionSettings.model_fields,
    *START,
    *("fault_seed", "navigation_filter", "navigation_sensors"),
}
"""Settings of nodes that an option holds."""
