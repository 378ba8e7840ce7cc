"""Comparison of the settings of two flights."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

from space_robot_msgs_py.bag.description import read_description
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.errors import InputError


class ChangedNumber(NamedTuple):
    """A setting with different values in two flights."""

    key: str
    """Dotted path in the resolved scenario."""
    first: Any
    """Value in the first flight; None if it is missing there."""
    second: Any


def recorded_scenario(bag: Path) -> dict[str, Any]:
    """Return the resolved scenario of a recorded flight."""
    flight = read_description(open_bag(bag).custom_data())
    if not isinstance(numbers := flight.get("scenario"), Mapping) or "robot_file" not in flight:
        raise InputError(f"{bag}: this bag does not hold its scenario: record the flight anew")
    plant = flight["robot_file"]
    assumed = flight.get("controller_robot_file", plant)
    robots = {"robot": assumed, **({} if assumed == plant else {"plant_robot": plant})}
    return {**numbers, **robots}


def differences(first: Any, second: Any, path: str = "") -> Iterator[ChangedNumber]:
    """Yield the differences of two resolved scenarios, in the order of the first's keys."""
    if isinstance(first, Mapping) and isinstance(second, Mapping):
        for key in dict.fromkeys((*first, *second)):
            inner = f"{path}.{key}" if path else str(key)
            yield from differences(first.get(key), second.get(key), inner)
    elif _are_records(first) and _are_records(second) and len(first) == len(second):
        for number, (one, other) in enumerate(zip(first, second, strict=True)):
            name = one.get("name", number) if one.get("name") == other.get("name") else number
            yield from differences(one, other, f"{path}.{name}")
    elif first != second:
        yield ChangedNumber(path, first, second)


def _are_records(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(entry, Mapping) for entry in value)
