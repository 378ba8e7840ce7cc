"""All metrics of a flight in one dictionary, ready for JSON."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from space_robot_msgs_py.bag.flight_log import FlightLog, Metric, blocks_of
from space_robot_msgs_py.bag.law_history import as_data, within
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.events import Capture

from .actuation import (
    BeyondLimits,
    Latency,
    MissedDeadlines,
    Saturation,
    StandingJoints,
    TorqueLimits,
)
from .attitude_drift import UNAVAILABLE, AttitudeDrift, controls_base
from .columns import recording
from .deflection import Deflection
from .described import (
    actuators_of,
    assumed_robot_of,
    captures_of,
    environment_of,
    event_labels,
    events_of,
    flown_actuators,
    momentum_of,
    navigation_of,
    robot_of,
    sensors_of,
    start_step_of,
    torque_limits,
)
from .described_estimator import estimator
from .estimate_error import EstimateError
from .external_torques import DisturbanceBySource
from .metrics import AttitudeError, Chatter, Maxima, Rms, tracking_error
from .missed_captures import MissedCaptures
from .momentum import MomentumBudget
from .navigation import NavigationError
from .pointing import BasePointing, Pointing, PointingBudget
from .ripple import Ripple
from .settling import Settling
from .sizing import ActuatorSet, Sizing
from .tool_error import ToolError
from .wheel_saturation import WheelSaturation

DESCRIBED = ("controller", "case", "gains", "robot")
"""Keys of a flight's description that a report repeats."""
OF_TRUTH = ("navigation_error",)
"""Metrics that only flights have whose truth was recorded beside what was measured."""
OF_FREE_BASE = ("attitude_drift",)
"""Metrics that only flights have in which nothing turns the base."""
OF_HELD_BASE = ("attitude_error_deg", "base_pointing")
"""Metrics that only flights have in which something turns the base."""
OF_HARDWARE = ("momentum",)
"""Metrics that only flights have whose base was not turned by ideal torques."""
OF_WHEELS = ("wheel_saturation",)
"""Metrics that only flights have whose base has reaction wheels."""
OF_ORBIT = ("disturbance_by_source",)
"""Metrics that only flights in an orbit have."""
OF_FREE_TARGETS = ("missed_captures",)
"""Metrics that only flights have with targets on neighbouring orbits."""
OF_GEARS = ("deflection",)
"""Metrics that only flights have whose joints have gears."""


def analyze(
    log: FlightLog, actuators: ActuatorSet | None = None, budget: PointingBudget | None = None
) -> dict[str, Any]:
    """Compute the flight's report, the same from a graph flight, an in-process one, or a bag.

    A metric that this flight does not have is None; ``unavailable`` says why, by its key. Of a
    flight with gaps (a broken bag) the longest stretch without one is analyzed; ``damage`` says so.

    Args:
        log: a flight.
        actuators: of the base, for the sizing; None: those that flew.
        budget: of the base's pointing; None: the default.

    Raises:
        InputError: no tick has both a state and a reference, or ``log`` is no flight.
    """
    if not isinstance(log, FlightLog):
        raise InputError(f"log: a FlightLog was expected (load_bag reads one), got {short(log)}")
    analysis = Analysis(actuators, log.ticks, budget)
    for block in blocks_of(_without_gaps(log)):
        analysis.add(block)
    return analysis.report()


class Analysis:
    """Does what `analyze` does, of a flight without gaps in blocks, as `blocks_of` cuts it."""

    def __init__(
        self,
        actuators: ActuatorSet | None = None,
        flight_ticks: int = 0,
        budget: PointingBudget | None = None,
    ) -> None:
        """Begin.

        Args:
            actuators: of the base, for the sizing; None: those that flew.
            flight_ticks: of the whole flight, if only a part of it follows.
            budget: of the base's pointing; None: the default.
        """
        self.ticks = 0
        """Rows so far."""
        self._flight_ticks = flight_ticks
        self._kinds = _METRICS | {
            "base_pointing": lambda log: BasePointing(log, budget),
            "sizing": lambda log: _sizing(log, actuators),
        }
        self._metrics: dict[str, Metric] = {}
        self._unavailable: dict[str, str] = {}
        self._head: dict[str, Any] = {}
        self._tail: dict[str, Any] = {}

    def add(self, block: FlightLog) -> None:
        """Take the next block."""
        if not self.ticks:
            self._begin(block)
        error = tracking_error(block)
        for metric in self._metrics.values():
            metric.add(block, error)
        self.ticks += block.ticks
        self._laws, self._timebase = block.laws, block.timebase
        self._tail = recording(block)

    def report(self) -> dict[str, Any]:
        """Return the report of all blocks so far, at least one."""
        metrics, unavailable = dict[str, Any].fromkeys(_METRICS), dict(self._unavailable)
        for name, metric in self._metrics.items():
            try:
                metrics[name] = metric.result()
            except InputError as error:
                unavailable[name] = str(error)
        stop, period_ns = self._first_tick + self.ticks, self._timebase.period_ns
        laws = within(self._laws, self._first_tick, stop)
        return {
            **self._head,
            **({"controller": laws[0].name} if laws else {}),
            "laws": as_data(laws, self._timebase),
            "ticks": self.ticks,
            "flight_ticks": max(self._flight_ticks, self.ticks),
            "duration_s": self.ticks * period_ns / 1e9,
            "from_s": self._first_tick * period_ns / 1e9,
            "to_s": stop * period_ns / 1e9,
            **metrics,
            "unavailable": {
                name: unavailable[name] for name in (*UNAVAILABLE, *_METRICS) if name in unavailable
            },
            **self._tail,
        }

    def _begin(self, block: FlightLog) -> None:
        self._first_tick = block.first_tick
        self._head = {
            **{key: block.flight.get(key) for key in DESCRIBED},
            "faults": [str(fault) for fault in block.flight.get("faults", ())],
            "events": event_labels(block),
            **{k: block.flight[k] for k in ("own_gains",) if k in block.flight},
            **{k: str(block.flight[k]) for k in ("disturbance",) if k in block.flight},
            "start_step": start_step_of(block),
            "sensors": sensors_of(block),
            "navigation": navigation_of(block),
            "actuators": actuators_of(block),
            "truth_recorded": block.measured is not None,
        }
        if not controls_base(block):
            self._unavailable |= UNAVAILABLE
        for name, metric in self._kinds.items():
            if name in OF_TRUTH and block.measured is None:
                continue
            if name in OF_FREE_BASE and controls_base(block):
                continue
            if name in OF_HELD_BASE and not controls_base(block):
                continue
            if name in OF_HARDWARE and not block.flight.get("base_actuators"):
                continue
            if name in OF_WHEELS and not block.wheel_velocities.shape[1]:
                continue
            if name in OF_ORBIT and not block.orbit_position.shape[1]:
                continue
            if name in OF_FREE_TARGETS and not _has_free_targets(block):
                continue
            if name in OF_GEARS and not block.geared_names:
                continue
            try:
                self._metrics[name] = metric(block)
            except InputError as error:
                self._unavailable[name] = str(error)


def _has_free_targets(log: FlightLog) -> bool:
    try:
        events = events_of(log)
    except InputError:
        return False
    return any(isinstance(event, Capture) and event.target.is_in_orbit for event in events)


def _without_gaps(log: FlightLog) -> FlightLog:
    without_gaps = log.longest_stretch()
    if not without_gaps.ticks:
        raise InputError("no tick has both a state and a reference")
    if without_gaps.ticks < log.ticks:
        start, stop = without_gaps.time[0], without_gaps.time[-1]
        said = f"analyzed from t = {start:.4f} to {stop:.4f} s, the longest stretch without a gap"
        without_gaps.damage += (said,)
    return without_gaps


def _missed_deadlines(log: FlightLog) -> MissedDeadlines:
    try:
        limits = torque_limits(log)
    except InputError:
        limits = TorqueLimits(np.inf, np.inf)
    is_ideal = not log.flight.get("base_actuators")
    return MissedDeadlines(int(log.flight.get("command_latency_ticks", 0)), limits, is_ideal)


def _disturbance_by_source(log: FlightLog) -> DisturbanceBySource:
    disturbance = environment_of(log).disturbance
    return DisturbanceBySource(disturbance, captures_of(log) if disturbance.table else None)


def _sizing(log: FlightLog, other: ActuatorSet | None) -> Sizing:
    return Sizing(log, ActuatorSet(actuators_of(log), flown_actuators(log)), other)


_METRICS: dict[str, Callable[[FlightLog], Metric]] = {
    "rms": lambda log: Rms(log.axes, controls_base(log), log.prismatic, log.branches),
    "maxima": lambda log: Maxima(log.axes, controls_base(log), log.prismatic, log.branches),
    "attitude_error_deg": lambda log: AttitudeError(),
    "attitude_drift": AttitudeDrift,
    "navigation_error": NavigationError,
    "chatter": lambda log: Chatter(
        log.axes, log.timebase.period, controls_base(log), log.prismatic, log.branches
    ),
    "ripple": lambda log: Ripple(log, robot_of(log)),
    "settling": Settling,
    "saturation": lambda log: Saturation(torque_limits(log)),
    "standing": StandingJoints,
    "beyond_limits": lambda log: BeyondLimits(log, robot_of(log)),
    "wheel_saturation": lambda log: WheelSaturation(log, flown_actuators(log).wheels),
    "latency": lambda log: Latency(log.timebase.period),
    "missed_deadlines": _missed_deadlines,
    "estimate_error": lambda log: EstimateError(log, *estimator(log)),
    "base_pointing": BasePointing,
    "pointing": lambda log: Pointing(log, robot_of(log)),
    "tool": lambda log: ToolError(log, captures_of(log), assumed_robot_of(log)),
    "sizing": lambda log: _sizing(log, None),
    "momentum": lambda log: MomentumBudget(momentum_of(log)),
    "disturbance_by_source": _disturbance_by_source,
    "deflection": Deflection,
    "missed_captures": lambda log: MissedCaptures(captures_of(log)),
}
"""By key of the report, each made from a flight's first block."""
