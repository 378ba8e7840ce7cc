"""A mission's file as a document, and the parameters that nodes take from it.

    mission:
      start: {joints_deg: [0, 120, 220, 0, -10, 0], base: {rpy_deg: [0, 0, 0]}}
      segments:
        - {tool: {xyz: [0.3, 0.0, -0.2]}, duration: 10}
      limits: {base_torque: 2.0}
      events: []

Older files hold ROS parameters of mission_node and plant_node; they are read on.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field

from space_robot_msgs_py.config.files import node_parameters
from space_robot_msgs_py.config.trees import Tree
from space_robot_msgs_py.config.validation import StrictModel, read_yaml, validate

from .orientation import Attitude

KEY = "mission"
PLANT = "plant"


class Start(StrictModel):
    """Posture and attitude that a mission begins with."""

    joints_deg: list[float] = Field(description="joints with motors, degrees, or m of prismatic")
    base: Attitude | None = None


class MissionDocument(StrictModel):
    """The content of a mission's file below the key ``mission``."""

    start: Start
    segments: list[dict[str, Any]] = Field(min_length=1)
    limits: dict[str, float | bool] = Field(default_factory=dict)
    events: list[Any] = Field(default_factory=list)

    def parameters(self) -> Tree:
        """Return the same as settings of a mission, with the plant's start and events."""
        base = [1.0, 0.0, 0.0, 0.0]
        if self.start.base is not None:
            base = np.asarray(self.start.base.unit_quaternion).tolist()
        return {
            "waypoint_times": [0.0],
            "waypoints_deg": self.start.joints_deg,
            "base_quaternion": base,
            "segments": [json.dumps(segment) for segment in self.segments],
            **({"limits": self.limits} if self.limits else {}),
            "initial_joints_deg": self.start.joints_deg,
            "initial_quaternion": base,
            **({"events": self.events} if self.events else {}),
        }


OF_PLANT = ("initial_joints_deg", "initial_quaternion", "events")
"""Settings of a mission for the plant: its initial state, captures and releases."""


def mission_layer(path: Path, node: str) -> Tree:
    """Return the parameters of a node in a parameter file, or in a mission's document.

    Raises:
        InputError: the file cannot be read, or is neither of both.
    """
    content = read_yaml(path)
    if set(content) != {KEY}:
        return node_parameters(path, node)
    settings = document_settings(content[KEY], f"{path}: {KEY}")
    return {key: v for key, v in settings.items() if (key in OF_PLANT) is (node == PLANT)}


def document_settings(content: Mapping[str, Any], where: str) -> Tree:
    """Return a mission's document as settings of mission and plant.

    Raises:
        InputError: naming ``where``, key, value given and values allowed.
    """
    return validate(MissionDocument, content, where).parameters()
