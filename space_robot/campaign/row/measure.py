"""Evaluates the blocks of one flight for the numbers of its row."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import norms
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.captures import Captures
from space_robot_sim.environment.environment import with_payload

from ...analysis.attitude_drift import attitude_drift
from ...analysis.metrics import tracking_error
from ...analysis.own_metric import OwnMetric
from ...analysis.pointing import PointingBudget, base_pointing_error
from ...analysis.tool_error import ToolError
from ...flight.plan import Flight
from ..study import Requirement
from .bands import Bands
from .columns import DRIFT, Columns, missing_for_jitter, missing_for_ripple
from .window import Window, WindowMetrics


class Measure:
    """Accumulates metrics, requirements' metrics and bands of a flight block by block."""

    def __init__(
        self,
        flight: Flight,
        require: Mapping[str, Requirement],
        own: Sequence[OwnMetric] = (),
        budget: PointingBudget | None = None,
    ) -> None:
        """Prepare the sums for a flight.

        Args:
            flight: not flown yet.
            require: the requirements by name.
            own: metrics of the user, which need `add_whole`.
            budget: of the base's pointing; None: the default.
        """
        self._own, self._demands = own, require
        self._own_results: dict[str, float] = {}
        self._own_windows: dict[str, float] = {}
        """By requirement."""
        names = {metric.name for metric in own}
        self._robot, columns = flight.robot, Columns.of_flight(flight)
        self._columns = columns
        self._flight = flight
        self._start: NDArray[np.float64] | None = None
        """(4,) attitude at the first tick."""
        self._tool: ToolError | None = None
        mission = flight.mission_settings
        budget = (budget or PointingBudget()).of(mission.written_segments, mission.base_point)
        self._axis = np.array(budget.axis)
        self._whole = WindowMetrics(Window(), columns.metrics, columns, budget)
        self._require = {
            name: WindowMetrics(_window(demand), [demand.metric], columns, budget)
            for name, demand in require.items()
            if not _is_whole(demand) and demand.metric not in names
        }
        self._same = {name: demand.metric for name, demand in require.items() if _is_whole(demand)}
        self._bands = Bands(flight.ticks)

    def add(self, block: FlightLog) -> None:
        """Add the next block of the flight."""
        error = tracking_error(block)
        sizes = self._columns.sizes(block, error)
        if self._columns.drift:
            self._start = block.quaternion[0].copy() if self._start is None else self._start
            sizes[DRIFT] = np.radians(norms(attitude_drift(block, self._start)))
        if self._columns.tool:
            self._tool = self._tool or _tool_error(block, self._flight)
            sizes |= zip(self._columns.tool, self._tool.errors(block).T, strict=True)
        pointing = None
        if self._columns.angles:
            pointing = base_pointing_error(block, self._axis)
            angles = np.degrees(pointing.rotation), *pointing.angles.T
            sizes |= zip(self._columns.angles, angles, strict=False)
        self._bands.add(block.first_tick, sizes)
        for metrics in (self._whole, *self._require.values()):
            metrics.add(block, error, sizes, self._robot, pointing)

    def add_whole(self, log: FlightLog) -> None:
        """Evaluate the user's own metrics of a complete flight, and those that are required.

        Raises:
            MetricError: a function raised an error, or returned no number.
        """
        for metric in self._own:
            self._own_results[metric.name] = metric.value(log)
            for name, demand in self._demands.items():
                if demand.metric == metric.name and not _is_whole(demand):
                    within = _window(demand).rows(log)
                    self._own_windows[name] = metric.value(log.rows(within.start, within.stop))

    def metrics(self) -> dict[str, float]:
        """Return the available metrics of the whole flight, by name."""
        return self._results | _finite(self._own_results)

    @cached_property
    def _results(self) -> dict[str, float]:
        return self._whole.result()

    def require(self) -> dict[str, float]:
        """Return the metric of each requirement in its window, by the requirement's name."""
        whole = self.metrics()
        values = {name: whole.get(metric) for name, metric in self._same.items()}
        for name, window in self._require.items():
            values[name] = next(iter(window.result().values()), None)
        values |= _finite(self._own_windows)
        return {name: value for name, value in values.items() if value is not None}

    def bands(self) -> dict[str, NDArray[np.float32]]:
        """Return the bands of each column over time."""
        return self._bands.result()


def _tool_error(log: FlightLog, flight: Flight) -> ToolError:
    settings = flight.plant_settings
    robot = with_payload(flight.robot, settings.payload)
    captures = Captures(settings.parsed_events, robot, flight.period, settings)  # not the plant's
    return ToolError(log, captures, flight.scenario.robots.controller)


def check_requirements(
    flight: Flight,
    require: Mapping[str, Requirement],
    where: str,
    context: str = "",
    own: Collection[str] = (),
    budget: PointingBudget | None = None,
) -> None:
    """Check that a flight has the metrics of all requirements.

    Args:
        flight: the nominal one, or one with a varied option.
        require: the requirements by name.
        where: the file, for errors.
        context: difference from the nominal flight, for errors.
        own: names of the user's own metrics.
        budget: of the base's pointing; None: the default.

    Raises:
        InputError: an unknown metric, a window without ticks, or one too short for the metric.
    """
    columns, end = Columns.of_flight(flight), flight.ticks * flight.period
    context = context and f" ({context})"
    for name, demand in require.items():
        key = f"{where}: require.{name}"
        try:
            one_of(demand.metric, (*columns.metrics, *own), "metric", f" in {key}.metric")
        except InputError as error:
            raise InputError(f"{error}{context}") from None
        if demand.from_s >= end:
            raise InputError(
                f"{key}.from_s: must be before the end of the flight ({end:g} s), "
                f"got {demand.from_s:g}{context}"
            )
        ticks = len(_window(demand).ticks(flight.ticks, flight.period))
        if not ticks:
            raise InputError(
                f"{key}.to_s: no tick between {demand.from_s:g} and {demand.to_s:g} s, "
                f"the period is {flight.period:g} s{context}"
            )
        seconds = (budget or PointingBudget()).window_s
        lacking = missing_for_ripple(demand.metric, ticks, flight.period)
        lacking = lacking or missing_for_jitter(demand.metric, ticks, flight.period, seconds)
        if lacking and demand.metric not in own:
            raise InputError(f"{key}.metric: {demand.metric} {lacking}{context}")


def _finite(values: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in values.items() if np.isfinite(value)}


def _window(demand: Requirement) -> Window:
    return Window(demand.from_s, demand.to_s)


def _is_whole(demand: Requirement) -> bool:
    return _window(demand) == Window()
