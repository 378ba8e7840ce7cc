"""The flight of a law without variations, and its variations in numbers.

A variation shares everything that it does not change with the nominal flight: no file is read
again, since a campaign varies it thousands of times.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any, NamedTuple

from pydantic import BaseModel

from space_robot_control.controller.gains import PARAMETERS, check_gains
from space_robot_control.laws import ControlLaw
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.files import GIVEN, Tree, flatten, merge
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.plant.settings import PLANT_KINDS, PlantNodeSettings

from ...api import Scenario
from ...flight.plan import Flight
from ...scenario.faults import KINDS, PROCESS_KINDS
from ...scenario.resolved import ResolvedScenario
from ..study import NOT_SETTABLE
from .paths import Elements, Path, Unavailable, numbered, plain, replaced
from .robot_numbers import robot_tree, robot_with

NODES = ("plant", "controller", "mission")
BY_OPTION = (
    *("robot", "mission", "case", "sensors", "actuators", "orbit", "period", "controller"),
    "gains",
)
"""Parameters that select files or laws; scenario options set them."""
INDEPENDENT = frozenset(
    {
        *("friction", "disturbance", "payload", "initial_joints_deg", "initial_quaternion"),
        *("orbital_elements", "gravity", "atmosphere", "sunlight", "magnetism"),
        "initial_rate_deg_s",
        *("torque_echo", "echo_scale", "echo_bias", "substeps", "command_latency_ticks"),
        *("drive_scale", "drive_bias", "drive_step", "drive_dead_band", "drive_lag"),
        *("base_torque_limit", "joint_torque_limit", *SensorSettings.model_fields),
    }
)
"""Parameters of the plant on which nothing else in a scenario depends."""
LOW_PASS = ("acceleration_filter_hz",)
"""The same for the controller."""
ORBIT_PARAMETERS = frozenset({"orbital_elements", "gravity", "sunlight"})
"""Those that a mission assumes to be known, if it depends on the orbit."""


class Variation(NamedTuple):
    """What differs from a nominal flight."""

    seed: int
    faults: list[str]
    """All faults of the flight."""
    parameters: Tree
    """Changed parameters by node; lists are complete."""
    plant_robot: Robot | None


class Nominal:
    """The flight of a law without variations."""

    def __init__(self, scenario: Scenario) -> None:
        """Resolve a scenario."""
        flight = scenario.check()
        self.scenario, self.resolved = scenario, flight.scenario
        self.names = flight.plant.names
        """Names of axes, wheels and thrusters."""

    @cached_property
    def tree(self) -> Tree:
        """All numbers that can be varied, by group."""
        law, robot = self.resolved.law, self.resolved.robots.plant
        nodes = {node: numbered(getattr(self.resolved, node).model_dump()) for node in NODES}
        start = dict(zip(robot.joint_names, self.resolved.plant.initial_joints_deg, strict=False))
        nodes["mission"]["start_deg"] = Elements(start, default="each")
        for tree in nodes.values():
            for name in BY_OPTION:
                use = "laws" if name in ("controller", "gains") else f"scenario.{name}"
                tree[name] = Unavailable(f"{name} applies to the whole flight: use {use}")
        gains = {
            name: Elements(dict(zip(self.names.axes, row.tolist(), strict=True)), default="all")
            for name, row in law.gain_values.items()
        }
        return {"robot": robot_tree(robot), "scenario": self._options(), **nodes, "gains": gains}

    def _options(self) -> Tree:
        values = self.scenario.given
        options = {
            name: values[name] if type(values.get(name)) in (int, float) else None
            for name in Scenario.model_fields
        }
        refused = {name: f"{name} cannot be set: {why}" for name, why in NOT_SETTABLE.items()}
        refused["gains"] = "gain sets are chosen by laws: [LAW=SET, LAW=OTHER_SET]"
        for name in ("faults", "events", "swaps", "parameters"):
            refused[name] = f"the option {name} has no elements to vary; see faults, plant.*"
        return options | {name: Unavailable(why) for name, why in refused.items()}

    def variation(self, values: Mapping[Path, Any], seed: int) -> Variation:
        """Return the variation with other values in the `tree`."""
        faults = list(self.scenario.faults)
        robot_numbers: dict[Path, Any] = {}
        others: dict[Path, Any] = {}
        for path, value in values.items():
            if path[0] == "robot":
                robot_numbers[path[1:]] = value
            elif path[0] == "faults":
                faults.append(path[1].replace("{}", repr(float(value)).removesuffix(".0")))
            else:
                others[path] = value
        parameters = plain(replaced(self.tree, others))
        if gains := parameters.pop("gains", None):
            controller = parameters.setdefault("controller", {})
            controller[self.resolved.law.name] = gains
        robot = self.resolved.robots.plant
        has_surfaces = self.resolved.plant.has_surfaces
        plant_robot = robot_with(robot, robot_numbers, has_surfaces) if robot_numbers else None
        return Variation(seed, faults, parameters, plant_robot)

    def scenario_with(self, variation: Variation) -> Scenario:
        """Return the scenario of a variation."""
        options = {**self.scenario.given, "seed": variation.seed}
        if variation.plant_robot is not None:
            options["plant_robot"] = variation.plant_robot
        if variation.faults:
            options["faults"] = variation.faults
        if variation.parameters:
            parameters = dict(options.get("parameters", {}))
            for node, own in variation.parameters.items():
                parameters[node] = {**parameters.get(node, {}), **dict(flatten(own))}
            options["parameters"] = parameters
        return Scenario(**options)

    def flight_with(self, variation: Variation) -> Flight:
        """Return the flight of a variation, as `scenario_with` gives it."""
        if (resolved := self._resolved(variation)) is None:
            return self.scenario_with(variation).check()
        flight = Flight(resolved)
        flight.check_in_process()
        return flight

    def _resolved(self, variation: Variation) -> ResolvedScenario | None:
        # None if this needs files, or if a number is invalid
        nominal, parameters = self.resolved, dict(variation.parameters)
        plant_changes = dict(parameters.pop("plant", {}))
        gains = dict(parameters.pop("controller", {}))
        low_pass = {name: gains.pop(name) for name in LOW_PASS if name in gains}
        are_gains = all(law in nominal.laws and isinstance(gains[law], dict) for law in gains)
        if parameters or not are_gains or not plant_changes.keys() <= INDEPENDENT:
            return None
        # navigation assumes to know the sensors' numbers if they have no file
        if (
            plant_changes.keys() & SensorSettings.model_fields.keys()
            and nominal.plant.sensors == GIVEN
        ):
            return None
        if plant_changes.keys() & ORBIT_PARAMETERS and nominal.reference.uses_orbit:
            return None
        options = nominal.options.model_copy(
            update={"seed": variation.seed, "faults": variation.faults}
        )
        plant_changes["faults"] = options.fault_texts(PLANT_KINDS) or [""]
        try:
            plant = _plant(nominal.plant, {**plant_changes, "fault_seed": variation.seed})
            laws = _laws(nominal, gains)
            type(nominal.controller).model_validate(low_pass)
        except ValueError:
            return None
        robots = nominal.robots
        return replace(
            nominal,
            options=options,
            plant=plant,
            controller=nominal.controller.model_copy(update=low_pass),
            gains=merge(nominal.gains, gains),
            robots=robots.with_plant(variation.plant_robot) if variation.plant_robot else robots,
            laws=laws,
            swaps=[(tick, laws[law.name]) for tick, law in nominal.swaps],
            process_faults=parse_faults(options.fault_texts(PROCESS_KINDS), KINDS),
        )


def _plant(nominal: PlantNodeSettings, changes: Tree) -> PlantNodeSettings:
    groups, plain_changes = {}, {}
    for name, value in changes.items():
        now = getattr(nominal, name)
        if isinstance(now, BaseModel):
            groups[name] = type(now).model_validate(merge(now.model_dump(), value))
        else:
            plain_changes[name] = value
    checked = type(nominal).model_validate(plain_changes)
    validated = {name: getattr(checked, name) for name in plain_changes}
    return nominal.model_copy(update=groups | validated)


def _laws(nominal: ResolvedScenario, gains: Tree) -> dict[str, ControlLaw]:
    # those that fly, or have other gains, are copies with their own memory
    flying = {nominal.law.name, *(law.name for _, law in nominal.swaps)}
    laws = {}
    for name, law in nominal.laws.items():
        laws[name] = copy.deepcopy(law) if name in flying | gains.keys() else law
        if name in gains:
            axes = len(law.memory.s)
            own = {**law.gain_values, **gains[name]}
            laws[name].gain_values = check_gains(own, type(law), axes, PARAMETERS)
    return laws
