"""Goals of a segment, as they are written: of a tool, and of the base."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from space_robot_model.elementary.matrices import direction_norm, norm, product
from space_robot_model.elementary.rotations import quaternion_of_rotation, rotation_of_rpy
from space_robot_model.robot.mission_document import Angles, Degrees, Orientation, Vector
from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import StrictModel, short

Array = NDArray[np.float64]

GoalFrame = Literal["inertial", "base", "start", "orbit"]
Point = Literal["nadir", "velocity", "sun", "target", "inertial"]
ABOUT = ("velocity", "nadir", "normal", "sun", "target")
"""Second directions that have a name; any other is a vector on inertial axes."""
FAR = math.sqrt(0.5)
"""Cosine of 45 degrees."""
LEAST_DEG = 1.0
"""Least angle between two directions that define an attitude, degrees."""


class ToolGoal(Orientation):
    """Where a tool goes in a straight line; without an orientation the shortest joint motion."""

    xyz: Vector | None = Field(None, description="position, m (none: it stays)")
    frame: GoalFrame = Field(
        "start",
        description="axes of the goal: inertial (origin: the base at t = 0), base (at the end of "
        "the segment), start (a displacement and a turn on inertial axes), or orbit (the same on "
        "axes that turn with the orbit: x ahead, y against its normal, z to the Earth's centre)",
    )
    link: str | None = Field(None, description="name of the tool, of a robot with several")
    least: Literal["motion", "momentum"] = Field(
        "motion",
        description="what a robot with more joints than the path needs keeps least: the motion of"
        " its joints, or the angular momentum that the base takes up",
    )

    @model_validator(mode="after")
    def _something(self) -> ToolGoal:
        if self.xyz is None and not self.is_given:
            raise ValueError("give xyz, rpy_deg or quaternion")
        return self


class BaseTurn(StrictModel):
    """``base: {turn_deg: 190, axis: [1, 2, 3]}``: a turn about one axis, from rest to rest."""

    turn_deg: Degrees = Field(description="angle, degrees")
    axis: Vector = Field(description="of the turn, base frame, any length")

    @model_validator(mode="after")
    def _has_axis(self) -> BaseTurn:
        direction_norm(self.axis, "axis")
        return self


class PointingGoal(StrictModel):
    """``base: {point: ...}``: where an axis of the base points, and how the base turns about it."""

    point: Point = Field(
        description="direction in which the axis points: nadir (the Earth's centre), velocity (of "
        "the orbit, as seen from the inertial frame), sun, target, or inertial (that of the key "
        "direction)"
    )
    axis: Vector = Field([0.0, 0.0, 1.0], description="axis that points, base frame, of any length")
    direction: Vector | None = Field(
        None, description="direction to point in, inertial axes, of any length: for point: inertial"
    )
    about: str | Vector | None = Field(
        None,
        description="second direction, towards which about_axis is turned as far as axis allows: "
        "velocity, nadir, normal (of the orbit), sun, target, or a vector on inertial axes (none: "
        "velocity for nadir, nadir for velocity, normal for target; for sun and inertial the "
        "inertial z axis, or x where z is within 45 degrees of the direction)",
    )
    about_axis: Vector | None = Field(
        None,
        description="axis that is turned towards about, base frame, of any length (none: the first "
        "of x, y and z that is at least 45 degrees from axis)",
    )
    offset_deg: Angles = Field(
        [0.0, 0.0, 0.0],
        description="roll, pitch, yaw about fixed axes, degrees: the base's attitude in the frame "
        "that points",
    )

    @field_validator("about", mode="before")
    @classmethod
    def _is_direction(cls, about: object) -> object:
        if isinstance(about, str) and about not in ABOUT:
            raise ValueError(f"{choices(about, ABOUT)}, or a direction [x, y, z] on inertial axes")
        return about

    @model_validator(mode="after")
    def _has_directions(self) -> PointingGoal:
        for key in ("axis", "direction", "about", "about_axis"):
            if isinstance(vector := getattr(self, key), list):
                direction_norm(vector, key)
        if (self.point == "inertial") != (self.direction is not None):
            raise ValueError(
                "point: inertial needs direction: [x, y, z], inertial axes"
                if self.direction is None
                else f"direction is for point: inertial, not for {self.point}"
            )
        if self.about == self.point:
            raise ValueError(
                f"about: {self.about} is the direction that the axis points in: choose another one "
                f"of {', '.join(name for name in ABOUT if name != self.point)}"
            )
        pairs = [("axis", self.axis, "about_axis", self.about_axis)]
        if isinstance(self.about, list):
            pairs.append(("direction", self.direction or [], "about", self.about))
        for name, first, other, second in pairs:
            if first and second and (angle := _line_angle(first, second)) < LEAST_DEG:
                raise ValueError(
                    f"{name} {short(first)} and {other} {short(second)} are parallel to "
                    f"{angle:.2g} degrees, at least {LEAST_DEG:g} are needed"
                )
        return self

    @property
    def from_base(self) -> Array:
        """(4,) quaternion from the base's frame to that whose first axis points.

        The second axis of that frame is in the half plane of the first one and ``about``.
        """
        near = np.abs(self.axis) > FAR * norm(self.axis)
        far = [float(k == int(np.argmin(near))) for k in range(3)]
        first = np.array(self.axis) / norm(self.axis)
        normal = np.cross(first, self.about_axis or far)
        normal = normal / norm(normal)
        axes = np.column_stack((first, np.cross(normal, first), normal))
        offset = rotation_of_rpy(np.radians(self.offset_deg))
        return quaternion_of_rotation(product(axes.T, offset))


def _line_angle(first: Sequence[float], second: Sequence[float]) -> float:
    a, b = np.array(first) / norm(first), np.array(second) / norm(second)
    return math.degrees(math.asin(min(norm(np.cross(a, b)), 1.0)))  # for comparisons only
