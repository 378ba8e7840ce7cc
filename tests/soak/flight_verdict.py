"""The verdict on a flight with faults: what went wrong that they do not explain."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from space_robot.analysis.metrics import tracking_error
from space_robot.flight.plan import Flight
from space_robot.processes.node_modules import MODULES
from space_robot.scenario.faults import KINDS
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import SpaceRobotError
from space_robot_msgs_py.samples import Array, Command, RobotState
from space_robot_msgs_py.wire.cdr import header_stamp_ns
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec
from space_robot_sim.faults.grammar import parse_faults


@dataclass
class FlightVerdict:
    """The verdict on one flight."""

    wrong: list[str] = field(default_factory=list)
    """Why it did not survive, a line each."""
    restarts: int = 0
    lost: int = 0
    """Messages lost that the faults do not explain."""
    attitude_error: float | None = None
    """Largest component of the quaternion's vector part; None: no bag."""
    joint_error: float | None = None
    """Largest, rad; None: no bag."""

    @property
    def survived(self) -> bool:
        """True if nothing went wrong."""
        return not self.wrong


def judge(flight: Flight, report: dict[str, Any] | None, bag: Path) -> FlightVerdict:
    """Judge a flight by its report and its bag.

    ``report`` is what `orchestrator.fly` returned; None if it raised, and then only what can be
    read is told.
    """
    verdict = FlightVerdict()
    kinds = [fault.kind.name for fault in parse_faults(flight.scenario.faults, KINDS)]
    if report is not None:
        verdict.restarts = report["graph"]["restarts"]
        verdict.wrong += unplanned_deaths(kinds, report["graph"]["events"])
    try:
        log = read_flight(bag)
        verdict.wrong += not_finite(bag, flight)
    except SpaceRobotError as error:
        if report is not None or bag.exists():
            verdict.wrong.append(f"the bag cannot be read: {error}")
        return verdict
    verdict.lost = sum(log.lost.values())
    verdict.attitude_error, verdict.joint_error = largest_errors(log)
    if verdict.lost and report is not None:  # else `fly` has said so
        verdict.wrong.append(f"messages lost: { {k: v for k, v in log.lost.items() if v} }")
    if log.unfinished and "kill_recorder" not in kinds:
        verdict.wrong.append(log.unfinished)
    return verdict


def unplanned_deaths(kinds: list[str], events: list[dict[str, Any]]) -> list[str]:
    """Return the nodes that died or hung, by a flight's events, more often than its faults say.

    ``kinds`` are the names of the faults' kinds.
    """
    wrong = []
    for node in MODULES:
        said = [event["what"] for event in events if event["node"] == f"{node}_node"]
        deaths = [what for what in said if what.startswith(f"{node} ended")]
        if len(deaths) > kinds.count(f"kill_{node}"):
            wrong.append(f"{deaths[-1]}, deaths: {len(deaths)}")
        if "does not answer" in said and f"stop_{node}" not in kinds:
            wrong.append(f"{node} hung")
    return wrong


def not_finite(bag: Path, flight: Flight) -> list[str]:
    """Find a command or an applied torque in a bag that is not a finite number.

    Raises:
        MessageError: a message that does not fit the flight's robot.
    """
    names, timebase = flight.plant.names, flight.timebase
    states, commands = StateCodec(names, timebase), CommandCodec(names.commanded, timebase)
    state = RobotState.allocate(len(names.joints))
    command = Command(0, np.zeros(len(names.commanded)))
    numbers = (state.applied_torque, state.wheel_torques, state.thrusts)
    for name, data in open_bag(bag).messages(topics.COMMAND, *states.topics):
        torques: tuple[Array, ...] = numbers
        if name == topics.COMMAND.full_name:
            commands.decode(data, command)
            torques = (command.torque,)
        else:
            states.decode(topics.BY_NAME[name], data, state)
        if not all(np.isfinite(torque).all() for torque in torques):
            at_s = header_stamp_ns(data) / 1e9
            return [f"{name} at t = {at_s:.4f} s has a torque that is not finite"]
    return []


def largest_errors(log: FlightLog) -> tuple[float, float]:
    """Return the largest attitude error (a component of the vector part) and joint error (rad)."""
    error = np.abs(tracking_error(log))
    return float(error[:, :3].max()), float(error[:, 3:].max())
