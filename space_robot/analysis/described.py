"""The robot, its hardware and its environment, as they were flown.

A flight in this process has its resolved scenario; that of a bag is resolved from its numbers. A
description without them, as of another recorder, is taken at its names' word: the robot and case of
that name here and now.
Files and modules that it names are opened only if the log is trusted (`FlightLog.trusted`).
What is not described, not here, or cannot be raises `InputError`.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.text import shortened
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.simulated_time import tick_from
from space_robot_sim.environment.captures import Captures
from space_robot_sim.environment.environment import with_payload
from space_robot_sim.environment.events import Event
from space_robot_sim.plant.settings import PlantNodeSettings

from ..flight.start_step import StartStep
from ..scenario.node_settings import FlightSettings
from ..scenario.recorded import recorded_options, recorded_scenario

IDEAL = "ideal"
"""Name of the sensors without error."""
MOST_LETTERS = 400
"""Of the joints' names in an error."""
DIRECT = "direct"
"""Name of the navigation without filter."""


class NotDescribedError(InputError):
    """The description in a bag lacks data that a metric needs."""


class TorqueLimits(NamedTuple):
    """Largest torque of each actuator of base and joints, N m; infinite where there is no limit."""

    base: float
    joint: float

    def each_axis(self, axes: int) -> Array:
        """Return the limit of each axis, (m,) N m."""
        return np.array([self.base] * 3 + [self.joint] * (axes - 3))


NO_LIMITS = TorqueLimits(np.inf, np.inf)


def recorded_start_step(log: FlightLog) -> dict[str, Any] | None:
    """Return the `StartStep` that the flight began with; None: none is described."""
    step, zero = log.flight.get("start_step"), StartStep()._asdict()
    if not isinstance(step, dict):
        return None
    known = {key: step.get(key) for key in zero}
    return known if [*map(type, known.values())] == [*map(type, zero.values())] else None


def flown_settings(log: FlightLog) -> FlightSettings:
    """Return the settings of the flight's nodes, with its robots."""
    if log.scenario is not None:
        settings: FlightSettings = log.scenario
        return settings
    return _resolved(json.dumps(log.flight), log.trusted)


@lru_cache(maxsize=8)
def _resolved(description: str, trusted: bool) -> FlightSettings:
    flight = json.loads(description)
    if not flight.keys() & {"scenario", "robot_file", "robot", "case", "mission", "orbit"}:
        raise NotDescribedError("the bag does not say what the plant was told")
    options = recorded_options(flight)
    for name in ("controller", "gains", "swaps", "without", "faults"):
        options.pop(name, None)  # no law is imported, nor its gains read
    return FlightSettings.resolve(recorded_scenario(options, trusted))


def flown_robot(log: FlightLog) -> Robot:
    """Return the robot that was flown."""
    if log.scenario is None and "robot" not in recorded_options(log.flight):
        raise NotDescribedError("the bag does not say which robot was flown")
    robot = flown_settings(log).robots.plant
    check_joints(robot, log)
    return robot


def plant_settings(log: FlightLog) -> PlantNodeSettings:
    """Return what the plant was told: its environment, orbit, actuators and limits."""
    return flown_settings(log).plant


def check_joints(robot: Robot, log: FlightLog) -> None:
    """Check that a robot has the joints of a bag; NotDescribedError: it has others."""
    if (robot.joint_names, robot.passive_names) != (log.joint_names, log.passive_names):
        recorded = _listed((*log.joint_names, *log.passive_names))
        own = _listed(robot.all_joint_names)
        raise NotDescribedError(f"robot {robot.name!r} has the joints {own}, the bag {recorded}")


def _listed(names: Sequence[str]) -> str:
    return shortened(", ".join(names) or "none", MOST_LETTERS)


def torque_limits(log: FlightLog) -> TorqueLimits:
    """Find the limits that the plant clipped the torques to; raises as `plant_settings`."""
    settings = plant_settings(log)
    return TorqueLimits(settings.base_torque_limit or np.inf, settings.joint_torque_limit or np.inf)


def flown_captures(log: FlightLog) -> Captures:
    """Return the captures and releases of the robot that flew, from the first rows ``log`` on."""
    settings = plant_settings(log)
    robot = with_payload(flown_robot(log), settings.payload)
    if robot.geared_names != log.geared_names:
        raise NotDescribedError(
            f"robot {robot.name!r} has gears in the joints {_listed(robot.geared_names)}, the bag "
            f"has motors of {_listed(log.geared_names)}"
        )
    captures = Captures(flown_events(log), robot, log.timebase.period, settings)
    for exchange in captures.exchanges:
        if exchange.target_state and exchange.tick < log.first_tick:
            raise NotDescribedError(
                f"whether {exchange.event.label} reached its target was before the first tick that "
                "is analyzed"
            )
    return captures


def flown_events(log: FlightLog) -> list[Event]:
    """Return the captures and releases, by time."""
    return plant_settings(log).parsed_events


def event_labels(log: FlightLog) -> list[str]:
    """Say in a few words each what was captured and released; as the bag has it if it cannot be."""
    try:
        return [event.label for event in flown_events(log)]
    except InputError:
        return [short(str(text)) for text in log.flight.get("events", ())]


def event_times(log: FlightLog) -> Array:
    """Return the times of the flight's events within ``log``, s; none if they are not known."""
    try:
        ticks = np.array([tick_from(e.time_s, log.timebase.period) for e in flown_events(log)])
    except InputError:
        ticks = np.empty(0)
    inside = (log.first_tick <= ticks) & (ticks < log.first_tick + log.ticks)
    times: Array = ticks[inside] * log.timebase.period
    return times


def flown_name(log: FlightLog, kind: str) -> str:
    """Return the name of the sensors, the navigation or the actuators, as far as it is recorded."""
    return str(log.flight.get(kind) or (DIRECT if kind == "navigation" else IDEAL))


def flown_actuators(log: FlightLog) -> BaseActuatorSettings:
    """Return the base's actuators, which fit the robot and the columns of the flight."""
    actuators = plant_settings(log)
    if actuators.base_actuation == "hardware":
        actuators.check(flown_robot(log), "of the bag")
    counts = log.wheel_velocities.shape[1], log.thrusts.shape[1]
    if counts != (actuators.wheel_count, actuators.thruster_count):
        raise NotDescribedError(
            f"the bag describes {actuators.wheel_count} wheels and {actuators.thruster_count} "
            f"thrusters, and has the states of {counts[0]} and {counts[1]}"
        )
    return actuators
