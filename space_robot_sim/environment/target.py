"""A target to be captured: a rigid body with its place in the tool's frame and its motion."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field, model_validator
from typing_extensions import Self

from space_robot_model.dynamics.attitude import rotation_matrix
from space_robot_model.elementary.matrices import direction_norm, norm
from space_robot_model.robot.inertia import Inertia, Mass
from space_robot_model.robot.parts import Triple
from space_robot_msgs_py.config.files import named_file
from space_robot_msgs_py.config.validation import StrictModel, read_yaml, validate

Array = NDArray[np.float64]


def _unit(quaternion: list[float]) -> list[float]:
    direction_norm(quaternion, "a quaternion")
    return quaternion


Speed = Annotated[float, Field(ge=-1e3, le=1e3)]
Speeds = Annotated[list[Speed], Field(min_length=3, max_length=3)]
Quaternion = Annotated[list[float], Field(min_length=4, max_length=4), AfterValidator(_unit)]
Name = Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[\w .+-]+$")]


class TargetPlace(StrictModel):
    """``target.place``: where the target is in the frame of the tool that holds it."""

    position: Triple = Field([0.0, 0.0, 0.0])
    """Position of the centre of mass, m."""
    quaternion: Quaternion = Field([1.0, 0.0, 0.0, 0.0])
    """``[w, x, y, z]`` of its axes; its norm does not count."""


class TargetMotion(StrictModel):
    """``target.motion``: how the target moves when it is grasped.

    On inertial axes, as seen from the inertial frame; or on the tool's axes, as seen from a tool
    that moves and turns itself (by default it stands still there). Relative to the orbit it is the
    motion at tick 0, from which the target falls freely: position and velocity on the orbit's axes
    (radial, along the path, along the normal), as seen from these turning axes.
    """

    relative_to: Literal["tool", "inertial", "orbit"] = "tool"
    velocity: Speeds = Field([0.0, 0.0, 0.0])
    """Velocity of the centre of mass, m/s."""
    angular_velocity: Speeds = Field([0.0, 0.0, 0.0])
    """rad/s; relative to the orbit on the target's own axes, as seen from the inertial frame."""
    position: Triple = Field([0.0, 0.0, 0.0])
    """Position of the centre of mass from the inertial frame's origin at tick 0, m."""
    quaternion: Quaternion = Field([1.0, 0.0, 0.0, 0.0])
    """``[w, x, y, z]`` of the target's axes at tick 0, to the inertial frame."""
    reach: Annotated[float, Field(gt=0.0, le=1e3)] = 0.05
    """Largest distance, m, between the target and where the tool would hold it, of a capture that
    does not miss."""

    @model_validator(mode="after")
    def _only_in_orbit(self) -> Self:
        keys = ("position", "quaternion", "reach")
        if self.relative_to != "orbit" and (unused := self.model_fields_set & {*keys}):
            raise ValueError(
                f"{', '.join(sorted(unused))} are for relative_to orbit, got {self.relative_to!r}"
            )
        return self


class Target(StrictModel):
    """``target``, the whole of a target's YAML; ``inertia`` (kg m2) is about its CoM, its axes."""

    name: Name = "target"
    mass: Mass
    inertia: Inertia
    tool: str = ""
    """The tool that grasps it, by name; empty: the robot's first."""
    place: TargetPlace = TargetPlace()
    motion: TargetMotion = TargetMotion()

    @classmethod
    def from_yaml(cls, path: str | Path) -> Target:
        """Read and check a target's file."""
        return cls.from_dict(read_yaml(Path(path)), where=str(path))

    @classmethod
    def from_dict(cls, content: dict[str, Any], where: str = "target") -> Target:
        """Build from the mapping a target's file holds (key ``target`` at its top)."""
        return validate(_TargetDocument, content, where).target

    @property
    def is_in_orbit(self) -> bool:
        """True if the target is on an orbit of its own until its capture."""
        return self.motion.relative_to == "orbit"

    @property
    def inline(self) -> str:
        """The target as an event's text holds it: JSON, a line; all digits are kept."""
        return json.dumps(self.model_dump(exclude_defaults=True))

    @property
    def rotation(self) -> Array:
        """(3, 3) rotation from the target's axes to the tool's."""
        out, quaternion = np.empty((3, 3)), np.array(self.place.quaternion)
        rotation_matrix(quaternion / norm(quaternion), out)
        return out


class _TargetDocument(StrictModel):
    target: Target


def find_target(name: str, folder: Path) -> Target:
    """Read the target of a file's name: one of ``config/targets``, or a path.

    A path that is not absolute begins where the program was started or, if nothing is there, in
    ``folder``, which is that of the mission's file.
    """
    path = Path(name)
    if path.suffix in (".yaml", ".yml") and not _is_file(path) and _is_file(folder / path):
        path = folder / path
    return Target.from_yaml(named_file("targets", str(path)))


def _is_file(path: Path) -> bool:
    try:
        return path.is_file()
    except (OSError, ValueError):  # what cannot be the name of a file
        return False
