"""A flight under analysis: its log, and what its description tells, each computed once."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import BLOCK_TICKS, FlightLog, block_bounds
from space_robot_msgs_py.topics import BASE_AXES

from . import described
from .errors import AxisIndex, attitude_error, controls_base, error_columns, groups_of
from .errors import torque_columns as columns_of_torque
from .pointing_budget import PointingBudget, pointing_of

Array = NDArray[np.float64]
ANGLES = ("half_cone", "about_axis", "base_rotation")
"""Columns of the base's pointing."""


class AnalysedLog:
    """A flight log without gaps, as the metrics see it; a flight need not have been flown."""

    def __init__(self, log: FlightLog, budget: PointingBudget | None = None) -> None:
        """``budget``: of the base's pointing; None: the default."""
        self.log = log
        self._budget = budget
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

    def parts(self, place: str) -> list[str]:
        """Return the names that a place in a metric's name stands for, see `series.expand`."""
        log = self.log
        names: dict[str, Iterable[str]] = {
            "error": self.error_columns,
            "torque": self.torque_columns,
            "axis": self.axis_names,
            "joint": log.joint_names,
            "wheel": [f"wheel_{i + 1}" for i in range(log.wheel_velocities.shape[1])],
            "angle": ANGLES,
            "event": () if place != "event" else described.event_labels(log),
        }
        return list(names[place])

    def blocks(self) -> Iterator[tuple[int, int]]:
        """Return first row and stop of each block, small enough for temporary arrays."""
        return block_bounds(self.log.ticks)

    def part(self, window: range) -> AnalysedLog:
        """Return the rows in a window as a flight of their own."""
        if window == range(self.log.ticks):
            return self
        return AnalysedLog(self.log.rows(window.start, window.stop), self._budget)

    def attitude_errors(self, start: int, stop: int) -> Array:
        """Return the `attitude_error` of some rows; of a short flight computed once."""
        if self.log.ticks > BLOCK_TICKS:
            return attitude_error(self.log.rows(start, stop))
        if "attitude_error" not in self.values:
            self.values["attitude_error"] = attitude_error(self.log)
        return self.values["attitude_error"][start:stop]
