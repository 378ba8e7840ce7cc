"""Scenarios of recorded flights, and the comparison of two."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from space_robot_control.laws.names import NotTrustedError, require_shipped_file
from space_robot_msgs_py.bag.description import read_description
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.config.files import Tree, flatten
from space_robot_msgs_py.config.validation import short, validate
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.disturbance_table import JSON
from space_robot_sim.environment.events import named_targets

from .scenario import Scenario

NAMED_FILES = (
    *("robot", "plant_robot", "case", "mission", "gains", "sensors", "navigation_sensors"),
    *("actuators", "assumed_actuators", "orbit", "disturbance", "disturbance.table"),
)
"""Options and parameters that may name a file."""


class ChangedNumber(NamedTuple):
    """A setting with different values in two flights or studies."""

    key: str
    """Dotted path in the resolved scenario."""
    first: Any
    """Value in the first flight; None if it is missing there."""
    second: Any


def options_in_bag(bag: Path) -> Tree:
    """Return the options of a recorded flight with every number: its resolved scenario."""
    flight = read_description(open_bag(bag).custom_data())
    if "scenario" not in flight:
        raise InputError(f"{bag}: this bag does not hold its scenario: record the flight anew")
    return recorded_options(flight)


def recorded_options(flight: Mapping[str, Any]) -> Tree:
    """Return the options of a described flight.

    Of a description without a scenario, as a plant gives that was not started by `fly`, these are
    the names and numbers in it.
    """
    plant = flight.get("robot_file", flight.get("robot"))
    assumed = flight.get("controller_robot_file", plant)
    named = {name: flight.get(name) for name in ("case", "orbit", "period", "events")}
    named |= {"mission": flight.get("mission", {}), "actuators": flight.get("base_actuators")}
    named |= {"robot": assumed, "plant_robot": None if assumed == plant else plant}
    said: Tree = dict(flight.get("scenario", {}))
    said |= {k: v for k, v in named.items() if v is not None and k not in said}
    return said


def recorded_scenario(options: Tree, trusted: bool, where: str = "scenario of the bag") -> Scenario:
    """Return the scenario of `recorded_options`; unless they are ``trusted``, no file is named.

    Raises:
        NotTrustedError: a file is named that is not a shipped one.
    """
    scenario = validate(Scenario, options, where)
    nodes = [dict(flatten(own)) for own in scenario.parameters.values()]
    mission = scenario.mission if isinstance(scenario.mission, dict) else {}
    for settings in () if trusted else (scenario.given, mission, *nodes):
        for what in NAMED_FILES:
            name = settings.get(what, "")
            if isinstance(name, str) and not name.startswith(JSON):
                require_shipped_file(what.partition(".")[0], name)
        for target in named_targets([str(text) for text in settings.get("events", ())]):
            require_shipped_file("target", target)
        for text in map(str, settings.get("segments", ())):
            if re.search(r"\bfile\b", text):
                raise NotTrustedError(
                    f"the bag refers to a file in {short(text)}: read only with --trust"
                )
    return scenario


def differences(first: Any, second: Any, path: str = "") -> Iterator[ChangedNumber]:
    """Yield the differences of two resolved scenarios or studies, in the order of the first's keys.

    The order of a study's variables (``vary``) is compared, too: its draws depend on it.
    """
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        for key in dict.fromkeys((*first, *second)):
            inner = f"{path}.{key}" if path else str(key)
            yield from differences(first.get(key), second.get(key), inner)
        if path.endswith("vary") and [*first] != [*second] and {*first} == {*second}:
            yield ChangedNumber(f"order of {path}", ", ".join(first), ", ".join(second))
    elif _are_records(first) and _are_records(second) and len(first) == len(second):
        for number, (one, other) in enumerate(zip(first, second, strict=True)):
            name = one.get("name", number) if one.get("name") == other.get("name") else number
            yield from differences(one, other, f"{path}.{name}")
    elif first != second:
        yield ChangedNumber(path, first, second)


def _are_records(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(entry, Mapping) for entry in value)
