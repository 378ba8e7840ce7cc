"""A mission's file as a document, and the parameters that nodes take from it.

    mission:
      start: {joints_deg: [0, 120, 220, 0, -10, 0], base: {rpy_deg: [0, 0, 0]}}
      segments:
        - {tool: {xyz: [0.3, 0.0, -0.2]}, duration: 10}
        - {base: {point: nadir}, duration: 60}
      limits: {base_torque: 2.0}
      events: []

A trajectory in a CSV or Parquet file is a mission, too: it begins at its first row.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from space_robot_msgs_py.config.columns import missing_column, read_columns
from space_robot_msgs_py.config.files import GIVEN, Tree, node_parameters
from space_robot_msgs_py.config.validation import StrictModel, read_yaml, validate
from space_robot_msgs_py.errors import InputError, explained_by

from ..elementary.matrices import direction_norm, norm
from ..elementary.rotations import quaternion_of_rotation, rotation_of_rpy
from .find import TRAJECTORIES, find_robot

Vector = Annotated[list[float], Field(min_length=3, max_length=3)]
Degrees = Annotated[float, Field(ge=-36_000.0, le=36_000.0)]
"""An angle of at most a hundred turns: of larger ones too few digits are left."""
Angles = Annotated[list[Degrees], Field(min_length=3, max_length=3)]
Rate = Annotated[float, Field(ge=-3_600.0, le=3_600.0)]
"""An angular velocity of at most ten turns a second, degrees/s."""
Rates = Annotated[list[Rate], Field(min_length=3, max_length=3)]
Quaternion = Annotated[list[float], Field(min_length=4, max_length=4)]
KEY = "mission"
PLANT = "plant"
QUATERNION = ("q_w", "q_x", "q_y", "q_z")
"""Columns of the base's attitude in a trajectory."""


class Orientation(StrictModel):
    """An orientation, as roll, pitch and yaw about fixed axes or as a quaternion; or none."""

    rpy_deg: Angles | None = Field(None, description="roll, pitch, yaw about fixed axes, degrees")
    quaternion: Quaternion | None = Field(None, description="w, x, y, z")

    @model_validator(mode="after")
    def _check_orientation(self) -> Orientation:
        if self.rpy_deg is not None and self.quaternion is not None:
            raise ValueError("rpy_deg and quaternion were given: give one of them")
        if self.quaternion is not None:
            direction_norm(self.quaternion, "quaternion")
        return self

    @property
    def is_given(self) -> bool:
        """Whether there is an orientation."""
        return self.rpy_deg is not None or self.quaternion is not None

    @property
    def unit_quaternion(self) -> NDArray[np.float64]:
        """(4,) ``[w, x, y, z]``; the identity if none is given."""
        if self.quaternion is not None:
            return np.array(self.quaternion) / norm(self.quaternion)
        return quaternion_of_rotation(rotation_of_rpy(np.radians(self.rpy_deg or [0.0] * 3)))


class Attitude(Orientation):
    """An orientation that must be given: that of the base."""

    @model_validator(mode="after")
    def _check_given(self) -> Attitude:
        if not self.is_given:
            raise ValueError("give rpy_deg or quaternion")
        return self


class StartBase(Orientation):
    """Attitude and rate of the base that a mission begins with; what is not given is zero."""

    rate_deg_s: Rates = Field(
        [0.0, 0.0, 0.0], description="angular velocity of the base, degrees/s, base axes"
    )

    @model_validator(mode="after")
    def _check_any(self) -> StartBase:
        if not self.model_fields_set:
            raise ValueError("give rpy_deg, quaternion, rate_deg_s, or point")
        return self


class Start(StrictModel):
    """Posture, attitude and rate that a mission begins with, or what its base points at."""

    joints_deg: list[float] = Field(description="joints with motors, degrees, or m of prismatic")
    base: StartBase | None = None
    base_point: str = Field("", description="what the base points at: base: {point: ...}, as JSON")

    @model_validator(mode="before")
    @classmethod
    def _as_written(cls, content: Any) -> Any:
        """Accept ``base: nadir`` and ``base: {point: ...}``."""
        base = content.get("base") if isinstance(content, dict) else None
        if isinstance(base, str):
            base = {"point": base}
        if not isinstance(base, dict) or "point" not in base:
            return content
        rest = {key: value for key, value in content.items() if key != "base"}
        return {**rest, "base_point": json.dumps(base)}


class MissionDocument(StrictModel):
    """The content of a mission's file below the key ``mission``."""

    start: Start
    segments: list[dict[str, Any]] = Field(min_length=1)
    limits: dict[str, float | bool] = Field(default_factory=dict)
    events: list[Any] = Field(default_factory=list)

    def parameters(self) -> Tree:
        """Return the same as settings of a mission, with the plant's start and events."""
        base, rate = [1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        if start := self.start.base:
            base, rate = np.asarray(start.unit_quaternion).tolist(), start.rate_deg_s
        parameters: Tree = {
            "joints_deg": self.start.joints_deg,
            "segments": [json.dumps(segment) for segment in self.segments],
            **({"limits": self.limits} if self.limits else {}),
            "initial_joints_deg": self.start.joints_deg,
            **({"events": self.events} if self.events else {}),
        }
        if self.start.base_point:  # the plant's attitude and rate follow from the orbit
            return parameters | {"base_point": self.start.base_point}
        if any(rate):
            parameters |= {"base_rate_deg_s": rate, "initial_rate_deg_s": rate}
        return parameters | {"base_quaternion": base, "initial_quaternion": base}


PLANT_KEYS = ("initial_joints_deg", "initial_quaternion", "initial_rate_deg_s", "events")
"""Settings of a mission for the plant: its initial state, captures and releases."""


@explained_by("own-trajectory")
def mission_layer(path: Path, node: str, robot: str) -> Tree:
    """Return the parameters of a node in a parameter file, a mission's document or a trajectory.

    Args:
        path: of the file.
        node: plant or mission.
        robot: name or path of the robot, whose joints are the columns of a trajectory.
    """
    if path.suffix in TRAJECTORIES:
        settings = trajectory_document(path, robot).parameters()
    elif set(content := read_yaml(path)) == {KEY}:
        settings = document_settings(content[KEY], f"{path}: {KEY}")
    elif content.keys() & MissionDocument.model_fields.keys():
        raise InputError(f"{path}: {next(iter(content))}: a mission stands below the key {KEY!r}")
    else:
        return node_parameters(path, node)
    return {key: v for key, v in settings.items() if (key in PLANT_KEYS) is (node == PLANT)}


def document_settings(content: Mapping[str, Any], where: str) -> Tree:
    """Return a mission's document as settings of mission and plant."""
    return validate(MissionDocument, content, where).parameters()


def trajectory_document(path: Path, robot: str) -> MissionDocument:
    """Return the mission that follows the trajectory of a file, from its first row on.

    Args:
        path: CSV or Parquet, with the columns of a segment ``file``.
        robot: name or path of the robot.

    Raises:
        InputError: the file cannot be read, or lacks a column or rows; or the robot has no file.
    """
    if robot == GIVEN:
        raise InputError(f"{path}: a trajectory is a mission of a robot with a file or name")
    columns, model = read_columns(path), find_robot(robot)
    joints = model.joint_names[: model.n]
    if missing := [name for name in ("time", *joints) if name not in columns]:
        raise InputError(f"{path}: {missing_column(missing[0], columns)}")
    if not columns["time"]:
        raise InputError(f"{path}: there are no rows below the names of the columns")
    first = {name: column[0] for name, column in columns.items()}
    slides = dict(zip(joints, model.is_prismatic.tolist(), strict=False))
    places = [first[name] if slides[name] else math.degrees(first[name]) for name in joints]
    start: Tree = {"joints_deg": places}
    if all(name in first for name in QUATERNION):
        start["base"] = {"quaternion": [first[name] for name in QUATERNION]}
    content = {"start": start, "segments": [{"trajectory": columns}]}
    return validate(MissionDocument, content, str(path))
