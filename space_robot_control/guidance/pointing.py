"""Pointing modes: the base turns with a direction that the assumed orbit gives.

The orbit is that of the reference point, beside which the robot is: its own motion of metres is not
followed. The Sun is where it is also while the Earth hides it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator, model_validator

from space_robot_model.elementary.matrices import direction_norm, dot_rows, norm, product
from space_robot_model.elementary.rotations import quaternion_of_rotation, rotation_of_rpy
from space_robot_model.orbit.ephemeris import Ephemeris
from space_robot_model.robot.mission_document import Angles
from space_robot_msgs_py.config.text import choices
from space_robot_msgs_py.config.validation import StrictModel, short
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]

Point = Literal["nadir", "velocity", "sun", "target", "inertial"]
Direction = Annotated[list[float], Field(min_length=3, max_length=3)]
ABOUT = ("velocity", "nadir", "normal", "sun", "target")
"""Second directions that have a name; any other is a vector on inertial axes."""
USUAL_ABOUT = {"nadir": "velocity", "velocity": "nadir", "target": "normal"}
FAR = math.sqrt(0.5)
"""Cosine of 45 degrees."""
LEAST_DEG = 1.0
"""Least angle between two directions that define an attitude, degrees."""
NEAREST = 0.1
"""Least distance of a target that is pointed at, m."""
CHECKED_EVERY = 1.0
"""Time between those at which a pointing segment is checked, s."""
AT_ONCE = 10_000
"""Times that are checked together."""


class PointingGoal(StrictModel):
    """``base: {point: ...}``: where an axis of the base points, and how the base turns about it."""

    point: Point = Field(
        description="direction in which the axis points: nadir (the Earth's centre), velocity (of "
        "the orbit, as seen from the inertial frame), sun, target, or inertial (that of the key "
        "direction)"
    )
    axis: Direction = Field(
        [0.0, 0.0, 1.0], description="axis that points, base frame, of any length"
    )
    direction: Direction | None = Field(
        None, description="direction to point in, inertial axes, of any length: for point: inertial"
    )
    about: str | Direction | None = Field(
        None,
        description="second direction, towards which about_axis is turned as far as axis allows: "
        "velocity, nadir, normal (of the orbit), sun, target, or a vector on inertial axes (none: "
        "velocity for nadir, nadir for velocity, normal for target; for sun and inertial the "
        "inertial z axis, or x where z is within 45 degrees of the direction)",
    )
    about_axis: Direction | None = Field(
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
        axes = _triad(self.axis, self.about_axis or _far_axis(self.axis))
        offset = rotation_of_rpy(np.radians(self.offset_deg))
        return quaternion_of_rotation(product(axes.T, offset))


class PointingCourse:
    """The base turns so that it points, at any time: also after the end of its segment."""

    def __init__(
        self, goal: PointingGoal, ephemeris: Ephemeris | None, begin: float, near: Array
    ) -> None:
        """Take what points where.

        Args:
            goal: the keys of the segment.
            ephemeris: of the assumed orbit; None: there is none.
            begin: s, of the segment.
            near: (4,) quaternion in whose hemisphere the first one is.

        Raises:
            InputError: there is no orbit or no target, but one is needed; names the key.
        """
        from .pointing_kernel import FIXED, NADIR, NORMAL, TARGET, VELOCITY  # slow to import

        kinds = {"nadir": NADIR, "velocity": VELOCITY, "normal": NORMAL, "target": TARGET}
        first: str | list[float] = goal.direction or goal.point
        for key, name in (("point", first), ("about", goal.about)):
            if not isinstance(name, str):
                continue
            if ephemeris is None:
                raise InputError(
                    f"base.{key}: {name} needs an orbit, and flight software knows of none: choose "
                    "one by --orbit NAME"
                )
            if name == "target" and not ephemeris.has_target:
                raise InputError(
                    f"base.{key}: target: flight software knows of no target in orbit: events of "
                    "the mission name one, such as capture@15:neighbouring_satellite"
                )
        self._goal, self._ephemeris, self._begin = goal, ephemeris, begin
        self._fixed, self._kinds = np.zeros((2, 3)), np.zeros(2, dtype=np.int64)
        second = goal.about or USUAL_ABOUT.get(goal.point)
        for k, name in enumerate((first, second)):
            if name is None:  # of a direction that does not move
                pointed = self._fixed[0]
                name = [0.0, 0.0, 1.0] if abs(pointed[2]) <= FAR else [1.0, 0.0, 0.0]
            if name == "sun" and ephemeris is not None:
                name = ephemeris.sun.tolist()
            self._kinds[k] = kinds[name] if isinstance(name, str) else FIXED
            if not isinstance(name, str):
                self._fixed[k] = np.array(name) / norm(name)
        self._from_base = goal.from_base
        self._anchors = np.empty((0, 4))
        self._near = near

    def check(self, begin: float, end: float) -> None:
        """Check that the attitude is defined from ``begin`` to ``end``, s.

        Raises:
            InputError: the second direction comes within a degree of the line of the first one, or
                the target to where the robot is; names key and time.
        """
        count = math.ceil((end - begin) / CHECKED_EVERY) + 1
        for first in range(0, count, AT_ONCE):
            numbers = np.arange(first, min(first + AT_ONCE, count), dtype=np.float64)
            time = np.minimum(begin + CHECKED_EVERY * numbers, end)
            sines, lengths = np.moveaxis(self._rows(time, self._anchors[:0])[:, 10:], 1, 0)
            nearest = int(np.argmin(lengths))
            if self._goal.point == "target" and not lengths[nearest] >= NEAREST:
                raise InputError(
                    f"base.point: target is {lengths[nearest]:.3g} m from the reference point at "
                    f"t = {time[nearest]:.6g} s: at least {NEAREST:g} m are needed to point at it"
                )
            smallest = int(np.argmin(sines))
            if not sines[smallest] >= math.sin(math.radians(LEAST_DEG)):
                point, about = self._goal.point, self._goal.about or "its default"
                raise InputError(
                    f"base.about: {short(about)} is {math.degrees(math.asin(sines[smallest])):.2g} "
                    f"degrees from the line of {point} at t = {time[smallest]:.6g} s, at least "
                    f"{LEAST_DEG:g} is needed: choose another direction"
                )

    def at(self, time: Array) -> Array:
        """Return (T, 10) at times (T,), s: quaternion, velocity and acceleration, base frame."""
        return self._rows(time, self._anchors_until(float(time.max(initial=0.0))))[:, :10]

    def _rows(self, time: Array, anchors: Array) -> Array:
        from .pointing_kernel import pointing_into  # slow to import

        out, has_j2, nodes = np.empty((len(time), 12)), 0.0, np.empty((0, 18))
        if self._ephemeris is not None:
            has_j2 = self._ephemeris.has_j2
            nodes = self._ephemeris.nodes(float(time.max(initial=0.0)))
        turn, begin = self._from_base, self._begin
        times = np.ascontiguousarray(time, dtype=np.float64)
        pointing_into(nodes, has_j2, self._kinds, self._fixed, turn, begin, anchors, times, out)
        return out

    def _anchors_until(self, latest: float) -> Array:
        """Return attitudes from the begin on, each in the hemisphere of that before it.

        They make a quaternion's sign a function of time alone, and continuous.
        """
        from .pointing_kernel import ANCHOR_S  # slow to import

        known = len(self._anchors)
        needed = max(int((latest - self._begin) / ANCHOR_S) + 1, 1)
        if needed > known:
            numbers = np.arange(known, needed + known // 2, dtype=np.float64)
            attitudes = self._rows(self._begin + ANCHOR_S * numbers, self._anchors[:0])[:, :4]
            last = self._anchors[-1] if known else self._near
            before = np.concatenate((last[np.newaxis], attitudes[:-1]))
            signs = np.where(dot_rows(before, attitudes) < 0.0, -1.0, 1.0)
            attitudes = attitudes * np.cumprod(signs, axis=0)
            self._anchors = np.concatenate((self._anchors, attitudes))
        return self._anchors


def _triad(first: Sequence[float], second: Sequence[float]) -> Array:
    """Return axes as columns (3, 3): the first vector's, in the plane of both, and the normal."""
    axis = np.array(first) / norm(first)
    normal = np.cross(axis, second)
    normal = normal / norm(normal)
    return np.column_stack((axis, np.cross(normal, axis), normal))


def _far_axis(axis: Sequence[float]) -> list[float]:
    """Return the first of the axes x, y, z that is at least 45 degrees from an axis."""
    near = np.abs(axis) > FAR * norm(axis)
    return [float(k == int(np.argmin(near))) for k in range(3)]


def _line_angle(first: Sequence[float], second: Sequence[float]) -> float:
    """Return the angle between the lines along two vectors, degrees; for comparisons only."""
    a, b = np.array(first) / norm(first), np.array(second) / norm(second)
    return math.degrees(math.asin(min(norm(np.cross(a, b)), 1.0)))
