"""Objects and numbers as values of flight options: robot, law, gains, settings.

An option's value is kept as it was given; the functions here turn it into what the nodes'
parameters are to be. Numbers that are given stand over no file: its name is `GIVEN` then.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from inspect import isabstract, isclass
from pathlib import PurePath
from typing import Annotated, Any

import numpy as np
from pydantic import BaseModel, BeforeValidator, PlainValidator

from space_robot_control.controller.law_choice import law_of
from space_robot_control.guidance.mission import MissionSettings
from space_robot_control.laws import ControlLaw, find_law, importable_name, laws
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.find import ROBOTS, robot_as_path
from space_robot_model.robot.mission_document import OF_PLANT, document_settings
from space_robot_msgs_py.config.files import GIVEN, Tree, is_named, nest
from space_robot_msgs_py.config.validation import StrictModel, validate
from space_robot_sim.actuators.actuators import ActuatorSettings
from space_robot_sim.environment.environment import EnvironmentSettings
from space_robot_sim.environment.events import Capture, Release
from space_robot_sim.environment.orbit import OrbitSettings

from .disturbances import as_disturbance


def _name(value: Any, otherwise: str) -> str:
    """Return the text of a name or a path; a number may stand for a name."""
    is_name = isinstance(value, (str, PurePath, int, float)) and not isinstance(value, bool)
    if not is_name or "\0" in str(value):
        raise ValueError(f"a name, a path or {otherwise} was expected")
    return str(value)


def _plain(value: Any) -> Any:
    """Return a copy made of mappings, lists, numbers and texts, as in a file."""
    if isinstance(value, BaseModel):
        return value.model_dump()
    if isinstance(value, (Capture, Release)):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if isinstance(value, (np.ndarray, np.generic)):
        return value.tolist()
    return [_plain(inner) for inner in value] if isinstance(value, (list, tuple)) else value


def _settings(schema: type[StrictModel], more: tuple[str, ...] = ()) -> Callable[[Any], Any]:
    """Accept a name, or settings of a ``schema``: an object or a mapping, with ``more`` keys."""

    def check(value: Any) -> str | Tree:
        if not isinstance(value, (Mapping, BaseModel)):
            return _name(value, f"{schema.__name__} (an object or a mapping)")
        tree = nest(_plain(value))
        if isinstance(value, BaseModel):  # one of more, as the plant's settings, holds these
            tree = {key: tree[key] for key in (*schema.model_fields, *more) if key in tree}
        own = {key: inner for key, inner in tree.items() if key not in more}
        validate(schema, own, "numbers given")
        return tree

    return check


def _mission(value: Any) -> str | Tree:
    """Accept a name, settings of a mission, or the content of its document."""
    if isinstance(value, Mapping) and "start" in (tree := nest(_plain(value))):
        document_settings(tree, "mission")
        return tree
    checked: str | Tree = _settings(MissionSettings, OF_PLANT)(value)
    return checked


def _robot(value: Any) -> str | Robot | Tree:
    if isinstance(value, Robot):
        return value
    if isinstance(value, Mapping):
        content: Tree = _plain(value)
        Robot.from_dict(content)
        return content
    return _name(value, "a Robot (an object or a mapping)")


def _law(value: Any) -> Any:
    if value is None or isinstance(value, ControlLaw):
        return value
    if isclass(value) and issubclass(value, ControlLaw) and not isabstract(value):
        return value
    if callable(value) and not isclass(value):
        return value
    return _name(value, "a ControlLaw (class or object), or a function")


def _gains(value: Any) -> str | Tree:
    if not isinstance(value, Mapping):
        return _name(value, "a mapping of gains to numbers")
    return _listed(nest(_plain(value)))


def _listed(gains: Tree) -> Tree:
    """Convert a number to a list of one, which applies to all axes."""
    return {
        name: _listed(value)
        if isinstance(value, dict)
        else value
        if isinstance(value, list)
        else [value]
        for name, value in gains.items()
    }


RobotGiven = Annotated[Any, PlainValidator(_robot)]
LawGiven = Annotated[Any, PlainValidator(_law)]
Gains = Annotated[Any, PlainValidator(_gains)]
MissionGiven = Annotated[Any, PlainValidator(_mission)]
Case = Annotated[Any, PlainValidator(_settings(EnvironmentSettings))]
Sensors = Annotated[Any, PlainValidator(_settings(SensorSettings))]
Actuators = Annotated[Any, PlainValidator(_settings(ActuatorSettings))]
DisturbanceGiven = Annotated[Any, PlainValidator(as_disturbance)]
OrbitGiven = Annotated[Any, PlainValidator(_settings(OrbitSettings))]
AssumedActuators = Annotated[Any, PlainValidator(_settings(BaseActuatorSettings))]
EventText = Annotated[str, BeforeValidator(_plain)]


def robot_setting(robot: str | Robot | Tree) -> str:
    """Return the value of the parameter ``robot``.

    A robot in memory has the mission and gains of the shipped one of its name, if there is one;
    a robot given by its numbers has none.
    """
    if isinstance(robot, str):
        return robot_as_path(robot)
    if isinstance(robot, dict):
        return GIVEN
    return robot.name if is_named(ROBOTS, robot.name) else GIVEN


def resolve_law(law: Any) -> str | type[ControlLaw] | ControlLaw | None:
    """Return a law unchanged, or a function wrapped as a law."""
    is_function = callable(law) and not isclass(law) and not isinstance(law, ControlLaw)
    return law_of(law) if is_function else law


def law_parameter(law: str | type[ControlLaw] | ControlLaw | None) -> str:
    """Return what the parameter ``controller`` says; `importable_name` of a law not shipped."""
    if law is None:
        return ""
    if isinstance(law, str):
        return law
    kind = law if isclass(law) else type(law)
    return kind.name if laws().get(kind.name) is kind else importable_name(kind)


def numbers_of(value: str | Tree) -> tuple[str, Tree]:
    """Return the name of the file and the numbers that override it."""
    return (value, {}) if isinstance(value, str) else (GIVEN, value)


def mission_of(mission: str | Tree) -> tuple[str, Tree, Tree]:
    """Return the file's name, and the settings for mission and plant.

    Unless it is given too, the plant begins at the mission's start.
    """
    if isinstance(mission, str):
        return mission, {}, {}
    if "start" in mission:
        mission = document_settings(mission, "mission")
    of_mission = {key: v for key, v in mission.items() if key not in OF_PLANT}
    settings = validate(MissionSettings, of_mission, "mission")
    start: Tree = {"initial_joints_deg": settings.joints_deg}
    if not settings.base_point.strip():
        start["initial_quaternion"] = settings.base_quaternion
    if any(settings.base_rate_deg_s):
        start["initial_rate_deg_s"] = settings.base_rate_deg_s
    return GIVEN, of_mission, start | {key: mission[key] for key in OF_PLANT if key in mission}


def gains_of(
    gains: str | Tree, law: str | type[ControlLaw] | ControlLaw | None
) -> tuple[str, Tree]:
    """Return the name of the set, and the gains that override it as ``<law>.<gain>``.

    Raises:
        InputError: the law does not exist.
    """
    if isinstance(gains, str):
        return gains, {}
    if not any(isinstance(value, dict) for value in gains.values()):
        of_law = find_law(law) if isinstance(law, str) else law
        gains = {of_law.name: gains} if of_law is not None else {}
    return "default", gains
