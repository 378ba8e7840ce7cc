"""What the base's pointing is measured against: axis, band and window."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from space_robot_model.elementary.matrices import direction_norm
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.mission_document import Vector
from space_robot_msgs_py.bag.flight_log import BLOCK_TICKS, FlightLog, block_bounds
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.config.yaml_text import parse_yaml
from space_robot_msgs_py.topics import BASE_AXES

from . import described
from .errors import AxisIndex, attitude_error, controls_base, error_columns, groups_of
from .errors import torque_columns as columns_of_torque

Array = NDArray[np.float64]

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

    def of(self, segments: Sequence[str], start: str = "") -> PointingBudget:
        """Return the budget with the axis that points, of unit length.

        Args:
            segments: of the mission, as YAML texts.
            start: what the base points at from the start on, as YAML text; empty: nothing.
        """
        pointed = pointed_axis(segments, start)
        axis = np.array(self.axis or (Z if pointed is None else pointed))
        unit = (axis / direction_norm(axis, "axis")).tolist()
        return self.model_copy(update={"axis": unit})


def pointed_axis(segments: Sequence[str], start: str = "") -> Array | None:
    """Return the axis (3,) of the first segment of a mission that points the base; None: none does.

    ``segments`` and ``start`` as in `PointingBudget.of`.
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


def pointing_of(log: FlightLog) -> tuple[list[str], str]:
    """Return segments and start of a log's mission, see `PointingBudget.of`, as far as it tells."""
    if log.scenario is not None:
        return log.scenario.mission.written_segments, log.scenario.mission.base_point
    scenario = log.flight.get("scenario")
    mission = scenario.get("mission") if isinstance(scenario, dict) else None
    if not isinstance(mission, dict):
        return [], ""
    segments = mission.get("segments")
    texts = [str(text) for text in segments] if isinstance(segments, list) else []
    return texts, str(mission.get("base_point") or "")


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
        """Store the log.

        Args:
            log: of the flight.
            budget: of the base's pointing; None: the default.
            other_actuators: for the sizing, in the place of those that flew.
        """
        self.log = log
        self._budget, self.other_actuators = budget, other_actuators
        self.values: dict[str, Array] = {}
        """Values of series that fit into one block, by the series' name."""

    @cached_property
    def budget(self) -> PointingBudget:
        """The pointing budget, with the axis that points."""
        return (self._budget or PointingBudget()).of(*pointing_of(self.log))

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
        return groups_of(self.log)

    @cached_property
    def error_columns(self) -> dict[str, AxisIndex]:
        """The axes of each error column."""
        return error_columns(self.groups)

    @cached_property
    def torque_columns(self) -> dict[str, AxisIndex]:
        """The axes of each torque column."""
        return columns_of_torque(self.groups)

    @cached_property
    def axis_names(self) -> list[str]:
        """Names of the n+3 axes."""
        return [*BASE_AXES, *self.log.joint_names]

    @cached_property
    def robot(self) -> Robot:
        """The robot that was flown.

        Raises:
            InputError: see `described.robot_of`.
        """
        return described.robot_of(self.log)

    @cached_property
    def actuators(self) -> BaseActuatorSettings:
        """The base's actuators that were flown.

        Raises:
            InputError: see `described.flown_actuators`.
        """
        return described.flown_actuators(self.log)

    @cached_property
    def torque_limits(self) -> described.TorqueLimits:
        """The limits that the plant clipped the torques to.

        Raises:
            InputError: see `described.torque_limits`.
        """
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
