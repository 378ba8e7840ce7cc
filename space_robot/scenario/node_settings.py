"""Settings of all nodes of a flight, resolved once for nodes, `simulate` and labels."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from inspect import isclass
from typing import Any

from pydantic import ValidationError

from space_robot_control.controller.gains import split_gains
from space_robot_control.controller.settings import DEFAULT, ControllerNodeSettings, gains_as_path
from space_robot_control.guidance.mission import (
    MissionNodeSettings,
    MissionSettings,
    pointing_start,
)
from space_robot_control.laws import find_law, importable_name, laws
from space_robot_control.navigation.settings import assumed_numbers
from space_robot_model.orbit.ephemeris import AssumedOrbit, AssumedTarget
from space_robot_model.robot import Robot
from space_robot_model.robot.find import robot_source
from space_robot_model.robot.mission_document import PLANT_KEYS, document_settings
from space_robot_msgs_py.bag.recorder import RecorderNodeSettings
from space_robot_msgs_py.config.files import GIVEN, Tree, flatten, merge, nest
from space_robot_msgs_py.config.settings import NodeSettings
from space_robot_msgs_py.config.validation import one_of, validate
from space_robot_msgs_py.errors import InputError, explained_by
from space_robot_sim.environment.events import Capture
from space_robot_sim.environment.neighbouring_orbit import target_state
from space_robot_sim.plant.settings import PLANT_KINDS, PlantNodeSettings

from .objects import NODES as NODES
from .objects import AnyLaw, resolve_law, robot_setting, table_parameters
from .options import OPTIONS
from .scenario import NO_FRICTION, Scenario

SCHEMAS: tuple[type[NodeSettings], ...] = (
    PlantNodeSettings,
    ControllerNodeSettings,
    MissionNodeSettings,
    RecorderNodeSettings,
)

_WAITING = "a flight's nodes wait for one another as they must"
NOT_TO_BE_SET = {
    "plant.ticks": "use --duration",
    "plant.wait_for": _WAITING,
    "plant.reset_with": "all nodes of a flight are reset",
    "plant.paused": "use --paused",
    "plant.own_controller": "use --without controller",
    "plant.join_timeout": "use --join-timeout",
    "controller.join_timeout": "use --join-timeout",
    "controller.wait_for": _WAITING,
    "controller.listener_timeout": _WAITING,
    "mission.wait_for": _WAITING,
    "mission.goto": "it is for a mission in flight: use space-robot goto",
    "recorder.bag": "use --bag",
    "recorder.flight": "it is what the flight's options say",
    "recorder.robot": "use --robot",
    **{f"{node}.autostart": "the flight starts its nodes together" for node in NODES},
    **{f"{node}.period": "use --period, which is for all nodes" for node in NODES},
}
"""Parameters set by the flight itself, and the option to use instead."""
SET_BY_OPTIONS = ("period", "paused")
"""Those among them that options of a flight set."""


RobotAndFile = tuple[Robot, Tree | None]
"""A robot, and the content of its file; None: of a robot in memory, whose own numbers count."""


@dataclass(frozen=True)
class Robots:
    """The robots of plant and controller, which have the same joints."""

    true: RobotAndFile
    assumed: RobotAndFile

    @classmethod
    def read(cls, nodes: Sequence[NodeSettings], robot: Any, plant_robot: Any = None) -> Robots:
        """Read the robots that plant, controller and mission name, or that options are.

        Raises:
            InputError: a robot does not exist, or its joints differ from the plant's.
        """
        sources = {} if isinstance(robot, str) else {robot_setting(robot): _source(robot)}
        for node in nodes if plant_robot is None else nodes[1:]:
            if node.robot not in sources:
                sources[node.robot] = _source(node.robot)
        plant = sources[nodes[0].robot] if plant_robot is None else _source(plant_robot)
        true, controller = plant[0], sources[nodes[1].robot]
        for node in nodes[1:]:
            other = sources[node.robot][0]
            if (other.joint_names, other.passive_names) != (true.joint_names, true.passive_names):
                raise InputError(
                    f"the robots of plant and {node.node} must have the same joints, got "
                    f"{true.name!r} with {', '.join(true.all_joint_names)} and "
                    f"{other.name!r} with {', '.join(other.all_joint_names)}"
                )
        return cls(plant, controller)

    def with_plant(self, robot: Robot) -> Robots:
        """Return the same robots but for the plant's, which has the same joints."""
        return replace(self, true=(robot, None))

    @property
    def plant(self) -> Robot:
        """The true robot."""
        return self.true[0]

    @property
    def controller(self) -> Robot:
        """The robot assumed by the flight software."""
        return self.assumed[0]

    @cached_property
    def options(self) -> dict[str, Tree]:
        """The robots' numbers as options of a flight; the plant's if it differs."""
        plant, controller = (
            robot.content if content is None else content
            for robot, content in (self.true, self.assumed)
        )
        return {"robot": controller, **({} if controller == plant else {"plant_robot": plant})}

    @property
    def description(self) -> dict[str, Any]:
        """Numbers of the plant's robot, and of the controller's if it differs."""
        assumed = self.options["robot"]
        if "plant_robot" not in self.options:
            return {"robot_file": assumed}
        return {
            "robot_file": self.options["plant_robot"],
            "controller_robot": self.controller.name,
            "controller_robot_file": assumed,
        }


def _source(robot: str | Robot | Tree) -> RobotAndFile:
    if isinstance(robot, str):
        file = robot_source(robot)
        return file.robot, file.content
    return (robot, None) if isinstance(robot, Robot) else (Robot.from_dict(robot), robot)


@dataclass(frozen=True)
class FlightSettings:
    """Settings of every node, the robots, and gains given directly by the user."""

    plant: PlantNodeSettings
    controller: ControllerNodeSettings
    mission: MissionNodeSettings
    recorder: RecorderNodeSettings
    gains: dict[str, Tree]
    """Gains by law, which override the gain set."""
    robots: Robots
    """Robot of the plant, and robot assumed by the flight software."""

    @staticmethod
    def resolve(scenario: Scenario) -> FlightSettings:
        """Resolve settings: options override files, single parameters override both.

        Raises:
            InputError: a parameter is invalid or cannot be set this way.
        """
        _check_may_be_set(scenario.parameters)
        chosen = {node: nest(values) for node, values in option_parameters(scenario).items()}
        plant = PlantNodeSettings.resolve(chosen["plant"])
        if events := [str(event) for event in plant.parsed_events]:  # with the targets' numbers
            plant = plant.model_copy(update={"events": events})
        controller, gains = _controller(chosen["controller"], plant)
        with explained_by("own-trajectory"):
            mission = MissionNodeSettings.resolve(chosen["mission"])
        mission = with_assumed_orbit(mission, plant)
        plant = _at_pointing_start(plant, mission)
        recorder = RecorderNodeSettings.resolve(chosen["recorder"])
        periods = {s.node: s.period for s in (plant, controller, mission, recorder)}
        if len(set(periods.values())) > 1:
            said = ", ".join(f"{node} {period:g}" for node, period in periods.items())
            raise InputError(
                f"the period must be the same for all nodes, got {said} s: use --period"
            )
        with explained_by("own-robot"):
            robots = Robots.read((plant, controller, mission), scenario.robot, scenario.plant_robot)
        return FlightSettings(plant, controller, mission, recorder, gains, robots)


def _controller(
    chosen: Tree, plant: PlantNodeSettings
) -> tuple[ControllerNodeSettings, dict[str, Tree]]:
    own, gains = split_gains(chosen)
    own.setdefault("actuators", plant.actuators)
    if plant.realtime:  # by the wall clock there is no time to wait
        own.setdefault("reference_timeout", 0.0)
    controller, asked = ControllerNodeSettings.resolve(own), dict(own)
    if (path := gains_as_path(controller.gains, controller.robot)) != controller.gains:
        own["gains"] = path
    if controller.navigation == "filtered" and "navigation_sensors" not in own:
        if plant.sensors == GIVEN:
            numbers = {"navigation_filter": assumed_numbers(plant, plant.period)}
            own = merge(numbers, own)
        else:
            own["navigation_sensors"] = plant.sensors
    if own != asked:
        controller = ControllerNodeSettings.resolve(own)
    if (filtered := controller.filter_settings) is not None:
        controller = controller.model_copy(update={"navigation_filter": filtered})
    return controller, gains


def with_assumed_orbit(
    mission: MissionNodeSettings, plant: PlantNodeSettings
) -> MissionNodeSettings:
    """Return a mission's settings in which what is not said of the assumed orbit is the plant's."""
    if not plant.has_orbit:
        return mission
    known: Tree = {
        "orbital_elements": plant.orbital_elements.model_dump(),
        "j2": plant.gravity.j2,
        "beta_angle_deg": plant.sunlight.beta_angle_deg,
        "noon_deg": plant.sunlight.noon_deg,
    }
    targets = [e.target for e in plant.parsed_events if isinstance(e, Capture)]
    for target in [target for target in targets if target.is_in_orbit][:1]:
        start = target_state(target, plant, 0.0)
        place = {"position": start.position.tolist(), "velocity": start.motion.velocity}
        with suppress(ValidationError):  # too far or too fast to be pointed at
            known["target"] = AssumedTarget(name=target.name, **place).model_dump()
    own = mission.assumed_orbit.model_dump(exclude_unset=True)
    assumed = validate(AssumedOrbit, merge(known, own), "mission.assumed_orbit")
    return mission.model_copy(update={"assumed_orbit": assumed})


def _at_pointing_start(plant: PlantNodeSettings, mission: MissionNodeSettings) -> PlantNodeSettings:
    if not mission.base_point.strip():
        return plant
    try:
        attitude, rate_deg_s = pointing_start(mission)
    except InputError as error:
        file = f"{mission.mission}: " if mission.mission not in ("", GIVEN) else ""
        raise InputError(f"{file}{error}") from None
    start = {"initial_quaternion": attitude, "initial_rate_deg_s": rate_deg_s}
    return plant.model_copy(
        update={key: value for key, value in start.items() if key not in plant.model_fields_set}
    )


def _check_may_be_set(parameters: Mapping[str, Mapping[str, Any]]) -> None:
    for node, values in parameters.items():
        one_of(node, NODES, "node", " in parameters")
        for name, _ in flatten(nest(values)):
            if why := NOT_TO_BE_SET.get(f"{node}.{name}"):
                raise InputError(f"{node}.{name} cannot be set: {why}")


def option_parameters(scenario: Scenario) -> dict[str, dict[str, Any]]:
    """Return the parameters that a scenario sets, by node and dotted name."""

    def changed(node: str) -> Tree:  # the others are as a node's files say
        return {
            name: getattr(scenario, name)
            for name, option in OPTIONS.items()
            if option.sets in (node, "all") and getattr(scenario, name) != option.default
        }

    robot, law = robot_setting(scenario.robot), resolve_law(scenario.controller)
    mission, waypoints, start = _mission(scenario.mission)
    gains, gain_values = _gains(scenario.gains, law)
    files: Tree = {"robot": robot, "mission": mission}
    numbers: Tree = {}
    for option in ("case", "orbit", "sensors", "actuators"):
        value = getattr(scenario, option)
        files[option] = value if isinstance(value, str) else GIVEN
        numbers |= {} if isinstance(value, str) else value
    if scenario.orbit == OPTIONS["orbit"].default:
        del files["orbit"]
    parameters: dict[str, Tree] = {
        "plant": {
            **files,
            **start,
            **numbers,
            **table_parameters(scenario.disturbance),
            "realtime": scenario.realtime,
            "command_latency_ticks": scenario.command_latency_ticks,
            "fifo_priority": scenario.fifo_priority,
            "faults": scenario.fault_texts(PLANT_KINDS),
            "fault_seed": scenario.seed,
            **({} if scenario.friction else NO_FRICTION),
        },
        "controller": {
            "robot": robot,
            **({"controller": _law_parameter(law)} if scenario.has_chosen_law else {}),
            "gains": gains,
            **gain_values,
            "fifo_priority": scenario.fifo_priority,
            "swaps": scenario.swaps,
        },
        "mission": {"robot": robot, "mission": mission, **waypoints},
        "recorder": {},
    }
    return {
        node: {**values, **changed(node), **scenario.parameters.get(node, {})}
        for node, values in parameters.items()
    }


def _law_parameter(law: str | AnyLaw | None) -> str:
    if law is None or isinstance(law, str):
        return law or ""
    kind = law if isclass(law) else type(law)
    return kind.name if laws().get(kind.name) is kind else importable_name(kind)


def _mission(mission: str | Tree) -> tuple[str, Tree, Tree]:
    if isinstance(mission, str):
        return mission, {}, {}
    if "start" in mission:
        mission = document_settings(mission, "mission")
    waypoints = {key: value for key, value in mission.items() if key not in PLANT_KEYS}
    settings = validate(MissionSettings, waypoints, "mission")
    start: Tree = {"initial_joints_deg": settings.joints_deg}
    if not settings.base_point.strip():
        start["initial_quaternion"] = settings.base_quaternion
    if any(settings.base_rate_deg_s):
        start["initial_rate_deg_s"] = settings.base_rate_deg_s
    return GIVEN, waypoints, start | {key: mission[key] for key in PLANT_KEYS if key in mission}


def _gains(gains: str | Tree, law: str | AnyLaw | None) -> tuple[str, Tree]:
    if isinstance(gains, str):
        return gains, {}
    if not any(isinstance(value, dict) for value in gains.values()):
        flown = find_law(law) if isinstance(law, str) else law
        gains = {flown.name: gains} if flown is not None else {}
    return DEFAULT, gains
