"""Settings of all nodes of a flight, resolved once for nodes, `simulate` and labels."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from space_robot_control.controller.gains import gains_as_path, split_gains
from space_robot_control.controller.settings import ControllerNodeSettings, set_file
from space_robot_control.guidance.settings import MissionNodeSettings
from space_robot_control.laws import ControlLaw
from space_robot_control.navigation.assumed_sensors import assumed_numbers
from space_robot_model.robot.find import mission_layers
from space_robot_msgs_py.bag.recorder_settings import RecorderNodeSettings
from space_robot_msgs_py.config.directory import config_directory
from space_robot_msgs_py.config.files import GIVEN, named_layers, node_parameters
from space_robot_msgs_py.config.settings import NodeSettings
from space_robot_msgs_py.config.trees import Tree, flatten, merge, nest
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.settings import PlantNodeSettings

SCHEMAS: tuple[type[NodeSettings], ...] = (
    PlantNodeSettings,
    ControllerNodeSettings,
    MissionNodeSettings,
    RecorderNodeSettings,
)
NODES = tuple(schema.node for schema in SCHEMAS)

_WAITING = "a flight's nodes wait for one another as they must"
NOT_TO_BE_SET = {
    "plant.ticks": "use --duration",
    "plant.wait_for": _WAITING,
    "plant.reset_with": "all nodes of a flight are reset",
    "plant.paused": "use --paused",
    "controller.wait_for": _WAITING,
    "controller.listener_timeout": _WAITING,
    "recorder.bag": "use --bag",
    "recorder.flight": "it is what the flight's options say",
    "recorder.robot": "use --robot",
    **{f"{node}.autostart": "the flight starts its nodes together" for node in NODES},
    **{f"{node}.period": "use --period, which is for all nodes" for node in NODES},
}
"""Parameters set by the flight itself, and the option to use instead."""

Given = Mapping[str, Mapping[str, Any]]
"""Parameters by node and dotted name."""


class FlightSettings(NamedTuple):
    """Settings of every node, and gains given directly by the user."""

    plant: PlantNodeSettings
    controller: ControllerNodeSettings
    mission: MissionNodeSettings
    recorder: RecorderNodeSettings
    gains: dict[str, Tree]
    """Gains by law, which override the gain set."""
    overrides: dict[str, tuple[str, ...]]
    """Dotted names of the settings of each node that override its files."""

    @classmethod
    def resolve(cls, options: Given, parameters: Given) -> FlightSettings:
        """Resolve settings: options override files, single parameters override both.

        Raises:
            InputError: a parameter is invalid or cannot be set this way.
        """
        check_may_be_set(parameters)
        overrides = {
            node: dict(flatten(nest({**options.get(node, {}), **parameters.get(node, {})})))
            for node in NODES
        }
        plant = PlantNodeSettings.resolve(overrides["plant"])
        mission = MissionNodeSettings.resolve(overrides["mission"])
        for node in (plant, mission):  # a file that is not shipped: a bag tells all of it
            for file in mission_layers(node.robot, node.mission):
                if config_directory() not in file.parents:
                    of_file = dict(flatten(node_parameters(file, node.node)))
                    overrides[node.node] = {**of_file, **overrides[node.node]}
        if events := [str(event) for event in plant.parsed_events]:  # their files' numbers too
            overrides["plant"]["events"] = events
            plant = plant.model_copy(update={"events": events})
        overrides["controller"].setdefault("actuators", plant.actuators)
        if plant.realtime:  # by the wall clock there is no time to wait
            overrides["controller"] = {"reference_timeout": 0.0, **overrides["controller"]}
        own, gains = split_gains(overrides["controller"])
        controller = ControllerNodeSettings.resolve(own)
        path = gains_as_path(controller.gains, controller.robot)
        of_flight = named_layers("actuators", controller.actuators)
        # as if given: a bag tells of it
        for file in (*of_flight, *set_file(controller.robot, path)):
            of_the_set = dict(flatten(node_parameters(file, "controller")))
            overrides["controller"] = {**of_the_set, **overrides["controller"]}
            own = merge(nest(of_the_set), own)
            controller = ControllerNodeSettings.resolve(own)
        if controller.navigation == "filtered" and "navigation_sensors" not in own:
            if plant.sensors == GIVEN:
                assumed = {"navigation_filter": assumed_numbers(plant, plant.period)}
                overrides["controller"] = {**dict(flatten(assumed)), **overrides["controller"]}
                own = merge(assumed, own)
            else:
                own["navigation_sensors"] = plant.sensors
                overrides["controller"]["navigation_sensors"] = plant.sensors
            controller = ControllerNodeSettings.resolve(own)
        settings = cls(
            plant,
            controller.model_copy(update={"gains": path}),
            mission,
            RecorderNodeSettings.resolve(overrides["recorder"]),
            gains,
            {node: tuple(names) for node, names in overrides.items()},
        )
        settings._check_periods()
        return settings

    def parameters(self, laws: Mapping[str, ControlLaw]) -> dict[str, dict[str, Any]]:
        """Return the resolved values of the parameters set for each node, by dotted name."""
        gains = {
            f"{name}.{gain}": values.tolist()
            for name, law in laws.items()
            for gain, values in law.gain_values.items()
        }
        parameters = {}
        for node, names in self.overrides.items():
            settings: NodeSettings = getattr(self, node)
            resolved = dict(flatten(settings.model_dump())) | gains
            parameters[node] = {name: resolved[name] for name in names if name in resolved}
        return parameters

    def _check_periods(self) -> None:
        periods = {node: getattr(self, node).period for node in NODES}
        if len(set(periods.values())) > 1:
            said = ", ".join(f"{node} {period:g}" for node, period in periods.items())
            raise InputError(
                f"the period must be the same for all nodes, got {said} s: use --period"
            )


def check_may_be_set(parameters: Given) -> None:
    """Check that the nodes exist and that no parameter is set by the flight itself.

    Raises:
        InputError: a parameter cannot be set; the message names the alternative.
    """
    for node, values in parameters.items():
        one_of(node, NODES, "node", " in parameters")
        for name, _ in flatten(nest(values)):
            if why := NOT_TO_BE_SET.get(f"{node}.{name}"):
                raise InputError(f"{node}.{name} cannot be set: {why}")
