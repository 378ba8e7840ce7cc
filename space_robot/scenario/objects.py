"""Objects and numbers as values of a scenario: what each option accepts beside a name.

Values are kept as they are given; numbers that are given stand over no file: its name is `GIVEN`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from inspect import isabstract, isclass
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ByteSize, TypeAdapter, ValidationError

from space_robot_control.controller.law_choice import law_of
from space_robot_control.guidance.mission import MissionSettings
from space_robot_control.laws import ControlLaw
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.find import ROBOTS, robot_as_path
from space_robot_model.robot.mission_document import PLANT_KEYS, document_settings
from space_robot_msgs_py.config.arguments import as_positive
from space_robot_msgs_py.config.files import GIVEN, Tree, flatten, is_named, nest
from space_robot_msgs_py.config.validation import (
    StrictModel,
    full_namespace,
    one_of,
    short,
    validate,
)
from space_robot_msgs_py.config.yaml_text import YamlTextError, parse_yaml
from space_robot_msgs_py.errors import InputError
from space_robot_sim.actuators.actuators import ActuatorSettings
from space_robot_sim.environment.disturbance_table import BASE, TIME, DisturbanceTable
from space_robot_sim.environment.environment import EnvironmentSettings
from space_robot_sim.environment.events import Capture, Release
from space_robot_sim.environment.orbit import OrbitSettings

NODES = ("plant", "controller", "mission", "recorder")
AnyLaw = type[ControlLaw] | ControlLaw


def _name(value: Any, otherwise: str) -> str:
    is_name = isinstance(value, (str, PurePath, int, float)) and not isinstance(value, bool)
    if not is_name or "\0" in str(value):
        raise ValueError(f"a name, a path or {otherwise} was expected")
    return str(value)


def _plain(value: Any) -> Any:
    if isinstance(value, BaseModel):
        return value.model_dump()
    if isinstance(value, (Capture, Release)):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(inner) for key, inner in value.items()}
    if hasattr(value, "tolist"):
        return value.tolist()
    return [_plain(inner) for inner in value] if isinstance(value, (list, tuple, range)) else value


def _settings(schema: type[StrictModel], value: Any, more: tuple[str, ...] = ()) -> str | Tree:
    if not isinstance(value, (Mapping, BaseModel)):
        return _name(value, f"{schema.__name__} (an object or a mapping)")
    tree: Tree = nest(_plain(value))
    if isinstance(value, BaseModel):  # one of more, as the plant's settings, holds these
        tree = {key: tree[key] for key in (*schema.model_fields, *more) if key in tree}
    own = {key: inner for key, inner in tree.items() if key not in more}
    validate(schema, own, "numbers given")
    return tree


def _mission(value: Any) -> str | Tree:
    if isinstance(value, Mapping) and "start" in (tree := nest(_plain(value))):
        document_settings(tree, "mission")
        return tree
    return _settings(MissionSettings, value, PLANT_KEYS)


def _robot(value: Any) -> str | Robot | Tree:
    if isinstance(value, Robot):
        return value
    if isinstance(value, Mapping):
        content: Tree = _plain(value)
        Robot.from_dict(content)
        return content
    return _name(value, "a Robot (an object or a mapping)")


def _law(value: Any) -> Any:
    if isclass(value) and issubclass(value, ControlLaw) and not isabstract(value):
        return value
    if value is None or isinstance(value, ControlLaw) or (callable(value) and not isclass(value)):
        return value
    return _name(value, "a ControlLaw (class or object), or a function")


def _gains(value: Any) -> str | Tree:
    if not isinstance(value, Mapping):
        return _name(value, "a mapping of gains to numbers")
    gains: Tree = _listed(nest(_plain(value)))
    return gains


def _listed(gains: Any) -> Any:
    if isinstance(gains, dict):
        return {name: _listed(value) for name, value in gains.items()}
    return gains if isinstance(gains, list) else [gains]


def _size(value: Any) -> int:
    try:
        return int(TypeAdapter(ByteSize).validate_python(value))
    except ValidationError as error:
        raise ValueError(error.errors()[0]["msg"]) from None


def _parameters(value: Any) -> dict[str, Tree]:
    parameters: dict[str, Tree] = {}
    if isinstance(value, list) and all(isinstance(text, str) for text in value):
        for text in value:
            set_parameter(parameters, text, "parameters")
    elif isinstance(value, Mapping) and all(isinstance(own, Mapping) for own in value.values()):
        parameters = {str(node): dict(flatten(own)) for node, own in value.items()}
    else:
        raise ValueError("a mapping of nodes to their parameters was expected")
    return parameters


def set_parameter(parameters: dict[str, Tree], text: str, where: str) -> None:
    """Put ``plant.hold_ticks=40`` into parameters by node and dotted name."""
    name, equals, value = text.partition("=")
    node, _, parameter = name.partition(".")
    if not (equals and parameter):
        raise InputError(
            f"{where} {short(text)}: NODE.PARAM=VALUE expected, as in plant.hold_ticks=40"
        )
    one_of(node, NODES, "node", f" in {where} {short(text)}")
    try:
        parsed = parse_yaml(value)
    except YamlTextError as error:
        raise InputError(f"{where} {short(name)}: {error}") from None
    parameters.setdefault(node, {}).update(flatten({parameter: parsed}))


PERIOD_S = 0.01
"""Period at which a function is sampled, s."""
Columns = dict[str, list[float]]
Load = Callable[[float], Mapping[str, float] | ArrayLike]


def sampled(function: Load, duration: float, period: float = PERIOD_S) -> Columns:
    """Return the columns of a disturbance that is given as a function of time.

        sr.Scenario(disturbance=sr.sampled(lambda t: {"base_torque_z": 0.1 * t}, duration=5.0))

    Args:
        function: of the time (s); returns numbers by column, see `DisturbanceTable`, or 6 numbers:
            force (N) and torque (N m) on the base, base frame.
        duration: s; the last row is at or just after it.
        period: s between two rows, between which the numbers are linear.
    """
    duration, period = as_positive(duration, "duration"), as_positive(period, "period")
    count = math.ceil(duration / period - 1e-6) + 1
    times = [k * period for k in range(count)]
    rows = [_row(function(time), time) for time in times]
    names = list(dict.fromkeys(name for row in rows for name in row))
    columns = {TIME: times, **{name: [row.get(name, 0.0) for row in rows] for name in names}}
    return DisturbanceTable.of(columns, "disturbance").columns


def as_disturbance(value: Any) -> str | Columns | Load:
    """Accept a path, columns or a function, or raise `ValueError` for pydantic."""
    if isinstance(value, Mapping):
        columns = {str(name): _plain(numbers) for name, numbers in value.items()}
        return DisturbanceTable.of(columns, "columns").columns
    if callable(value) and not isclass(value):
        function: Load = value
        return function
    if isinstance(value, str) or hasattr(value, "__fspath__"):
        return str(value)
    raise ValueError("a CSV or Parquet file, columns (a mapping) or a function was expected")


def table_parameters(disturbance: str | Columns | Load) -> dict[str, str]:
    """Return the parameter of the plant for an option; none of a function, which is sampled."""
    if callable(disturbance) or not disturbance:
        return {}
    if isinstance(disturbance, str):
        return {"disturbance.table": disturbance}
    return {"disturbance.table": DisturbanceTable(disturbance).text}


def _row(value: Any, time: float) -> dict[str, float]:
    returned = f"disturbance: the function returned {short(value)}"
    is_list = isinstance(value, Sequence) and not isinstance(value, str)
    is_array = isinstance(value, np.ndarray) and value.ndim > 0
    if (is_list or is_array) and len(value) == len(BASE):
        value = dict(zip(BASE, value, strict=True))
    if not isinstance(value, Mapping):
        raise InputError(
            f"{returned} at {time:g} s; a mapping of numbers by column, or {len(BASE)} numbers "
            f"({', '.join(BASE)}), was expected"
        )
    row = {}
    for name, number in value.items():
        is_number = isinstance(number, (int, float)) or getattr(number, "shape", 0) == ()
        row[str(name)] = float(number) if is_number and np.isrealobj(number) else math.nan
        if not math.isfinite(row[str(name)]):
            raise InputError(f"{returned} at {time:g} s; a number was expected for {name}")
    return row


CONVERTERS: Mapping[str, Callable[[Any], Any]] = {
    "robot": _robot,
    "plant_robot": _robot,
    "controller": _law,
    "gains": _gains,
    "mission": _mission,
    "case": partial(_settings, EnvironmentSettings),
    "sensors": partial(_settings, SensorSettings),
    "actuators": partial(_settings, ActuatorSettings),
    "assumed_actuators": partial(_settings, BaseActuatorSettings),
    "orbit": partial(_settings, OrbitSettings),
    "disturbance": as_disturbance,
    "events": _plain,
    "namespace": lambda value: full_namespace(value) if isinstance(value, str) else value,
    "split_size": _size,
    "parameters": _parameters,
}
"""What converts or refuses a value of a field."""


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


def resolve_law(law: Any) -> str | AnyLaw | None:
    """Return a law unchanged, or a function wrapped as a law."""
    is_function = callable(law) and not isclass(law) and not isinstance(law, ControlLaw)
    return law_of(law) if is_function else law
