"""Files for the nodes of a flight whose robot or actuators are given as numbers."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from space_robot_control.allocation.assumed_actuators import OWNER
from space_robot_msgs_py.config.files import GIVEN

from ..plan import Flight

Parameters = Mapping[str, Mapping[str, Any]]


def with_files(parameters: Parameters, flight: Flight, folder: Path) -> dict[str, dict[str, Any]]:
    """Write the files that nodes read, and return parameters that name them.

    Args:
        parameters: of every node.
        flight: their numbers.
        folder: for the files.
    """
    named = {node: dict(values) for node, values in parameters.items()}
    numbers = flight.scenario.tree
    for node in ("plant", "controller", "mission"):
        if named[node].get("robot") == GIVEN:
            option = "plant_robot" if node == "plant" and "plant_robot" in numbers else "robot"
            named[node]["robot"] = _write(folder / f"{option}.yaml", numbers[option])
    if named["controller"].get("actuators") == GIVEN or "assumed_actuators" in numbers:
        assumed = flight.scenario.assumed_actuators.model_dump(mode="json")
        content = {f"{OWNER}_node": {"ros__parameters": assumed}}
        named["controller"]["actuators"] = _write(folder / "assumed_actuators.yaml", content)
    return named


def _write(path: Path, content: Any) -> str:
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return str(path)
