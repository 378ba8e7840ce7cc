"""A flight log as metrics see it, a part of it by time, and the budget of the base's pointing."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, field_validator

from space_robot_model.elementary.matrices import Array, direction_norm
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.mission_document import Vector
from space_robot_msgs_py.bag.flight_log import BLOCK_TICKS, FlightLog, block_bounds
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.config.arguments import as_path
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.config.yaml_text import parse_yaml
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES

from . import described
from .errors import AxisIndex, attitude_error, axis_groups, controls_base

Z = (0.0, 0.0, 1.0)


class PointingBudget(StrictModel):
    """What the base's pointing is measured against."""

    band_deg: Annotated[float, Field(gt=0.0, le=180.0)] = Field(
        0.1, description="angle within which the base points well, degrees"
    )
    window_s: Annotated[float, Field(gt=0.0, le=1e6)] = Field(
        1.0, description="window over which jitter counts, s"
    )
    axis: Vector | None = Field(
        None,
        description="axis of the base that points, base frame, any length (none: of the mission's "
        "first pointing segment, or of its start, else z)",
    )

    @field_validator("axis", mode="after")
    @classmethod
    def _has_direction(cls, axis: list[float] | None) -> list[float] | None:
        if axis is not None:
            direction_norm(axis, "axis")
        return axis

    def along(self, pointed: Array | None) -> PointingBudget:
        """Return the budget with an axis of unit length: its own, else the ``pointed`` one (3,)."""
        axis = np.array(self.axis or (Z if pointed is None else pointed))
        unit = (axis / direction_norm(axis, "axis")).tolist()
        return self.model_copy(update={"axis": unit})


def pointed_axis(segments: Sequence[str], start: str = "") -> Array | None:
    """Return the axis (3,) of the first segment of a mission that points the base; None: none does.

    The segments are YAML texts, as is what the base points at from the ``start`` on.
    """
    for text in [*segments, f"base: {start}"]:
        with suppress(ValueError, TypeError, AttributeError):  # a bag may hold anything
            base = parse_yaml(text).get("base")
            base = {"point": base} if base == "nadir" else base
            if isinstance(base, dict) and "point" in base:
                axis = np.array(base.get("axis", Z), dtype=np.float64)
                direction_norm(axis, "axis")
                return axis
    return None


def window_ticks(window_s: float, period: float) -> int:
    """Return the number of ticks in a window, at least 2; ``period`` in s."""
    return max(2, round(window_s / period))


ANGLES = ("half_cone", "about_axis", "base_rotation")
"""Columns of the base's pointing."""


class AnalysedLog:
    """A flight log without gaps, as the metrics see it; a flight need not have been flown."""

    def __init__(
        self,
        log: FlightLog,
        budget: PointingBudget | None = None,
        other_actuators: BaseActuatorSettings | None = None,
    ) -> None:
        """``other_actuators``: for the sizing, in the place of those that flew."""
        self.log = log
        self._budget, self.other_actuators = budget, other_actuators
        self.values: dict[str, Array] = {}
        """Values of series that fit into one block, by the series' name."""

    @cached_property
    def pointed_axis(self) -> Array | None:
        """(3,) the axis that the mission points; None: it points none, or is not known."""
        with suppress(InputError):
            mission = described.flown_settings(self.log).mission
            return pointed_axis(mission.written_segments, mission.base_point)
        return None

    @cached_property
    def budget(self) -> PointingBudget:
        """The pointing budget, with the axis that points, of unit length."""
        return (self._budget or PointingBudget()).along(self.pointed_axis)

    @property
    def period(self) -> float:
        """Of a tick, s."""
        return self.log.timebase.period

    @cached_property
    def controls_base(self) -> bool:
        """Whether the base had actuators; else it floated freely."""
        return controls_base(self.log)

    @cached_property
    def groups(self) -> dict[str, AxisIndex]:
        """The axes by group, see `axis_groups`."""
        log = self.log
        return axis_groups(log.axes - 3, self.controls_base, log.prismatic, log.branches)

    @cached_property
    def error_columns(self) -> dict[str, AxisIndex]:
        """The axes of each error column of Table V."""
        groups = self.groups.items()
        return {"attitude" if k == "base" else f"joints_{k}": axes for k, axes in groups}

    @cached_property
    def torque_columns(self) -> dict[str, AxisIndex]:
        """The axes of each torque column of Table V."""
        names = {"base": "base_torque", "prismatic": "force_prismatic"}
        return {names.get(k, f"torque_{k}"): axes for k, axes in self.groups.items()}

    @cached_property
    def axis_names(self) -> list[str]:
        """Names of the n+3 axes."""
        return [*BASE_AXES, *self.log.joint_names]

    @cached_property
    def robot(self) -> Robot:
        """The robot that was flown, see `described.flown_robot`."""
        return described.flown_robot(self.log)

    @cached_property
    def actuators(self) -> BaseActuatorSettings:
        """The base's actuators that were flown, see `described.flown_actuators`."""
        return described.flown_actuators(self.log)

    @cached_property
    def torque_limits(self) -> described.TorqueLimits:
        """The limits that the plant clipped the torques to, see `described.torque_limits`."""
        return described.torque_limits(self.log)

    def parts(self, place: str) -> list[str]:
        """Return the names that a place in a metric's name stands for, see `series.expand`."""
        log = self.log
        wheels = [f"wheel_{i + 1}" for i in range(log.wheel_velocities.shape[1])]
        if place == "event":
            return described.event_labels(log)
        names: dict[str, Iterable[str]] = {
            "error": self.error_columns,
            "torque": self.torque_columns,
            "axis": self.axis_names,
            "base_axis": BASE_AXES,
            "base_part": [*BASE_AXES, *wheels],
            "joint": log.joint_names,
            "wheel": wheels,
            "angle": ANGLES,
        }
        return list(names[place])

    def blocks(self) -> Iterator[tuple[int, int]]:
        """Return first row and stop of each block, small enough for temporary arrays."""
        return block_bounds(self.log.ticks)

    def sum_up(self, function: Callable[[int, int], Any]) -> Array:
        """Return the sum of what a function makes of the rows of each block."""
        total: Array = np.sum([function(*block) for block in self.blocks()], axis=0)
        return total

    def part(self, window: range) -> AnalysedLog:
        """Return the rows in a window as a flight of their own."""
        if window == range(self.log.ticks):
            return self
        rows = self.log.rows(window.start, window.stop)
        return AnalysedLog(rows, self._budget, self.other_actuators)

    def attitude_errors(self, start: int, stop: int) -> Array:
        """Return the `attitude_error` of some rows; of a short flight computed once."""
        if self.log.ticks > BLOCK_TICKS:
            return attitude_error(self.log.rows(start, stop))
        if "attitude_error" not in self.values:
            self.values["attitude_error"] = attitude_error(self.log)
        return self.values["attitude_error"][start:stop]


def load_bag(
    path: str | Path, remap: Mapping[str, str] | None = None, namespace: str | None = None
) -> FlightLog:
    """Read a recorded flight as NumPy arrays, one row a tick.

    Some of its fields, for N ticks and n joints:

    - ``time`` (N,) s, simulated
    - ``quaternion`` (N, 4) ``[w, x, y, z]``, the base's attitude in the inertial frame
    - ``angular_velocity`` (N, 3) rad/s, in the base frame
    - ``base_position`` (N, 3) m and ``base_velocity`` (N, 3) m/s, in the inertial frame
    - ``joint_positions`` (N, n) rad and ``joint_velocities`` (N, n) rad/s
    - ``applied_torque`` (N, n+3) N m over the interval that ended at the tick: base x, y, z in the
      base frame, then the joints
    - ``commanded_torque`` (N, n+3) N m, the answer to the tick; None if not recorded
    - ``reference_joints`` (N, 3, n) desired position, velocity, acceleration: rad, rad/s, rad/s2
    - ``reference_base`` (N, 10) desired quaternion ``[w, x, y, z]``, angular velocity rad/s and
      acceleration rad/s2, in the base frame
    - ``joint_names``, and ``description``: what was flown (controller, case, gains, ...)
    - ``damage``, ``unfinished``, ``lost``: what is wrong with the bag, empty or zero if nothing.
      Ticks that could not be read are NaN; ``whole`` (N,) says which are not.

    Args:
        path: the bag's folder, or a single .mcap or .db3 file.
        remap: our topic by the bag's, as in ``{"/arm/joint_states": "/joint_states"}``.
        namespace: of the robot to be read, as ``/sat1``; None: of the only one in the bag.

    Raises:
        InputError: no bag is there, or no flight in it; one line says why.
    """
    return read_flight(as_path(path, "path"), remap, namespace=namespace)


ROUNDING = 1e-6
"""Ticks by which a time may miss the tick it means."""


def excerpt(log: FlightLog, from_s: float | None, to_s: float | None) -> FlightLog:
    """Return the ticks with ``from_s <= t < to_s``, views into the arrays of ``log``.

    What was lost or filled is not known by time: these counts stay those of the whole flight.
    Unanswered ticks are counted anew where the commands are known.

    Without ``from_s`` from its start, without ``to_s`` to its end; s.

    Raises:
        InputError: the times are reversed, outside the flight, or hold not one tick.
    """
    if from_s is None and to_s is None:
        return log
    period = log.timebase.period
    begin, end = log.first_tick * period, (log.first_tick + log.ticks) * period
    low, high = begin if from_s is None else from_s, end if to_s is None else to_s
    times = {"--from": from_s, "--to": to_s}
    limits = " ".join(f"{name} {value:g}" for name, value in times.items() if value is not None)
    if low >= high and None not in (from_s, to_s):
        raise InputError(f"{limits}: the start must come before the end")
    if not (begin - ROUNDING * period <= low < end and begin < high <= end + ROUNDING * period):
        raise InputError(f"{limits}: outside the flight, which lasts from {begin:g} to {end:g} s")
    first, stop = (math.ceil(t / period - ROUNDING) - log.first_tick for t in (low, high))
    if first >= stop:
        raise InputError(f"{limits}: no tick lies between (one every {period:g} s)")
    cut = log.rows(first, stop)
    if cut.commanded_torque is not None:
        cut.unanswered = int(np.count_nonzero(np.isnan(cut.commanded_torque[:, 0])))
    return cut
