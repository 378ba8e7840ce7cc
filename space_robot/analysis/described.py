"""The robot, its hardware and its environment, as they were flown.

A flight in this process has its resolved scenario, a bag the numbers. A description without them,
as of another recorder, is taken at its names' word: the robot and case of that name here and now.
Files and modules that it names are opened only if the log is trusted (`FlightLog.trusted`).
What is not described, not here, or cannot be raises `InputError`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.laws.names import require_shipped_file
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.files import nest
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.config.text import shortened
from space_robot_msgs_py.config.validation import short, validate
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.simulated_time import tick_from
from space_robot_sim.actuators.actuators import ActuatorSettings
from space_robot_sim.environment.captures import Captures
from space_robot_sim.environment.disturbance_table import JSON
from space_robot_sim.environment.environment import EnvironmentSettings, with_payload
from space_robot_sim.environment.events import Event, named_targets, parse_events
from space_robot_sim.plant.settings import PlantNodeSettings

from ..flight.start_step import StartStep

Array = NDArray[np.float64]

IDEAL = "ideal"
"""Name of the sensors without error."""
MOST_LETTERS = 400
"""Of the joints' names in an error."""
_NUMBERS = {
    name for schema in (EnvironmentSettings, ActuatorSettings) for name, _ in leaves(schema)
}
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


def start_step_of(log: FlightLog) -> dict[str, Any] | None:
    """Return the `StartStep` that the flight began with; None: none is described."""
    step, zero = log.flight.get("start_step"), StartStep()._asdict()
    if not isinstance(step, dict):
        return None
    known = {key: step.get(key) for key in zero}
    return known if [*map(type, known.values())] == [*map(type, zero.values())] else None


def robot_of(log: FlightLog) -> Robot:
    """Build the robot that was flown."""
    if log.scenario is not None:
        robot: Robot = log.scenario.robots.plant
        return robot
    flight = log.flight
    if isinstance(content := flight.get("robot_file"), dict):
        robot = Robot.from_dict(content, where="robot_file of the bag")
    elif name := flight.get("robot"):
        check_files(log, {"robot": name})
        robot = find_robot(str(name))
    else:
        raise NotDescribedError("the bag does not say which robot was flown")
    check_joints(robot, log)
    return robot


def assumed_robot_of(log: FlightLog) -> Robot:
    """Build the robot that the flight software assumed: if none is named, the one that flew."""
    if log.scenario is not None:
        robot: Robot = log.scenario.robots.controller
        return robot
    if isinstance(content := log.flight.get("controller_robot_file"), dict):
        return Robot.from_dict(content, where="controller_robot_file of the bag")
    return robot_of(log)


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
    base, joint = settings.base_torque_limit, settings.joint_torque_limit
    if base_actuators_of(log).base_actuation != IDEAL:
        base = 0.0  # hardware has limits of its own
    return TorqueLimits(base or np.inf, joint or np.inf)


def captures_of(log: FlightLog) -> Captures:
    """Return the captures and releases of the robot that flew, from the first rows ``log`` on."""
    settings = plant_settings(log)
    robot = with_payload(robot_of(log), settings.payload)
    if robot.geared_names != log.geared_names:
        raise NotDescribedError(
            f"robot {robot.name!r} has gears in the joints {_listed(robot.geared_names)}, the bag "
            f"has motors of {_listed(log.geared_names)}"
        )
    captures = Captures(events_of(log), robot, log.timebase.period, settings)
    for exchange in captures.exchanges:
        if exchange.target_state and exchange.tick < log.first_tick:
            raise NotDescribedError(
                f"whether {exchange.event.label} reached its target was before the first tick that "
                "is analyzed"
            )
    return captures


def events_of(log: FlightLog) -> list[Event]:
    """Return the captures and releases, by time."""
    if log.scenario is not None:
        events: list[Event] = log.scenario.plant.parsed_events
        return events
    texts = [str(text) for text in log.flight.get("events", ())]
    if not log.trusted:
        for name in named_targets(texts):
            require_shipped_file("target", name)
    return parse_events(texts)


def event_labels(log: FlightLog) -> list[str]:
    """Say in a few words each what was captured and released; as the bag has it if it cannot be."""
    try:
        return [event.label for event in events_of(log)]
    except InputError:
        return [short(str(text)) for text in log.flight.get("events", ())]


def event_times(log: FlightLog) -> Array:
    """Return the times of the flight's events within ``log``, s; none if they are not known."""
    try:
        ticks = np.array([tick_from(e.time_s, log.timebase.period) for e in events_of(log)])
    except InputError:
        ticks = np.empty(0)
    inside = (log.first_tick <= ticks) & (ticks < log.first_tick + log.ticks)
    times: Array = ticks[inside] * log.timebase.period
    return times


def plant_settings(log: FlightLog) -> PlantNodeSettings:
    """Return what the plant was told: its environment, orbit, actuators and limits."""
    if log.scenario is not None:
        settings: PlantNodeSettings = log.scenario.plant
        return settings
    parameters = parameters_of(log, PlantNodeSettings.node)
    if parameters.keys() >= _NUMBERS:
        return validate(PlantNodeSettings, nest(parameters), "plant parameters of the bag")
    if not parameters:
        names = ("robot", "case", "mission", "orbit")
        parameters = {key: log.flight[key] for key in names if key in log.flight}
    if not parameters:
        raise NotDescribedError("the bag does not say what the plant was told")
    check_files(log, parameters)
    # the columns of the bag and `base_actuators` have these, while their files may be elsewhere
    for in_bag in ("actuators", "sensors"):
        parameters.pop(in_bag, None)
    return PlantNodeSettings.resolve(parameters)


def sensors_of(log: FlightLog) -> str:
    """Return the name of the sensors, as far as the bag records it."""
    return _recorded_name(log, PlantNodeSettings.node, "sensors") or IDEAL


def navigation_of(log: FlightLog) -> str:
    """Return the name of the navigation, as far as the bag records it."""
    return _recorded_name(log, ControllerNodeSettings.node, "navigation") or DIRECT


def _recorded_name(log: FlightLog, node: str, key: str) -> str:
    if log.scenario is not None:
        return str(getattr(getattr(log.scenario, node), key))
    return str(parameters_of(log, node).get(key, ""))


def actuators_of(log: FlightLog) -> str:
    """Return the name of the base's actuators, as far as the bag records it."""
    return str(log.flight.get("actuators", "")) or IDEAL


def base_actuators_of(log: FlightLog) -> BaseActuatorSettings:
    """Return the base's actuators: ideal ones if the bag records none."""
    if log.scenario is not None:
        actuators: BaseActuatorSettings = log.scenario.plant
        return actuators
    recorded = log.flight.get("base_actuators", {})
    return validate(BaseActuatorSettings, recorded, "base_actuators of the bag")


def flown_actuators(log: FlightLog) -> BaseActuatorSettings:
    """Return `base_actuators_of` a flight, whose robot and columns they fit."""
    actuators = base_actuators_of(log)
    if actuators.base_actuation == "hardware":
        actuators.check(robot_of(log), "of the bag")
    counts = log.wheel_velocities.shape[1], log.thrusts.shape[1]
    if counts != (actuators.wheel_count, actuators.thruster_count):
        raise NotDescribedError(
            f"the bag describes {actuators.wheel_count} wheels and {actuators.thruster_count} "
            f"thrusters, and has the states of {counts[0]} and {counts[1]}"
        )
    return actuators


def check_files(log: FlightLog, parameters: Mapping[str, Any]) -> None:
    """Check that nothing but what is shipped is read, unless the bag is trusted."""
    if not log.trusted:
        for what in ("robot", "case", "mission", "gains", "sensors", "actuators", "orbit"):
            require_shipped_file(what, str(parameters.get(what, "")))
        if not (table := str(parameters.get("disturbance.table", ""))).startswith(JSON):
            require_shipped_file("disturbance", table)


def parameters_of(log: FlightLog, node: str) -> dict[str, Any]:
    """Return the parameters of a node, as far as the bag records them."""
    parameters = log.flight.get("parameters")
    own = parameters.get(node) if isinstance(parameters, dict) else None
    return dict(own) if isinstance(own, dict) else {}
