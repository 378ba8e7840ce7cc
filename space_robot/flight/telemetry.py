"""Telemetry of a flight: its packets from a log, and the database for the ground."""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import numpy as np

from space_robot_control.controller.live_telemetry import LiveTelemetry, telemetry_structures
from space_robot_control.controller.supervisor import Report
from space_robot_control.controller.tick import MODES
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog, block_bounds
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.telemetry.downlink import PacketWriter, open_sink, parse_udp
from space_robot_msgs_py.telemetry.recorded import log_columns, log_events
from space_robot_msgs_py.telemetry.structures import Structures

from ..console.files import write_text
from .plan import Flight

DATABASE = ".xml"
EVENT = re.compile(r"(\w+)@([0-9]*\.?[0-9]+(?:[eE][+-]?[0-9]+)?)")
"""Kind and time at the beginning of a fault or capture as it is written."""


class TelemetryPlan(NamedTuple):
    """What is sent of a robot, and what the ground has to know of it."""

    robot: Robot
    actuators: BaseActuatorSettings
    """As the flight software assumes them."""
    structures: Structures
    laws: tuple[str, ...]
    timeline: list[tuple[float, str]]
    """Planned captures and faults: time, s, and text."""

    @classmethod
    def of_flight(cls, flight: Flight) -> TelemetryPlan:
        """Return the plan of a flight that is to be flown."""
        scenario, settings = flight.scenario, flight.controller_settings
        names = flight.controller.names
        structures = telemetry_structures(settings.telemetry_packets, names, flight.timebase)
        texts = *scenario.faults, *scenario.plant.events
        robot, actuators = scenario.robots.controller, scenario.assumed_actuators
        return cls(robot, actuators, structures, tuple(flight.laws), _timeline(texts))

    @classmethod
    def of_log(cls, log: FlightLog, packets: str) -> TelemetryPlan:
        """Return the plan of a recorded flight; ``packets``: name or path of a file.

        Raises:
            InputError: the bag does not tell the robot, or the file is wrong.
        """
        flown = log.flight
        if not {"robot_file", "controller"} <= flown.keys():
            raise InputError("the bag does not tell its robot, so its telemetry has no database")
        robot = Robot.from_dict(flown.get("controller_robot_file", flown["robot_file"]))
        own = flown.get("base_actuators", {})
        actuators = validate(BaseActuatorSettings, own, "the bag's base_actuators")
        timebase = Timebase(log.timebase.period_ns)
        structures = telemetry_structures(packets, actuators.robot_names(robot), timebase)
        laws = {*(law.name for law in log.laws), str(flown["controller"])}
        with suppress(KeyError, TypeError):  # a bag may hold anything
            laws |= {*map(str, flown["scenario"]["gains"])}
        texts = [t for key in ("faults", "events") for t in flown.get(key) or ()]
        return cls(robot, actuators, structures, tuple(laws), _timeline(texts))

    @property
    def database(self) -> str:
        """Database of the telemetry and the telecommands, XTCE.

        Raises:
            InputError: the libraries are not installed.
        """
        check_libraries()
        from space_robot_msgs_py.telemetry.database import database

        limits = signal_limits(self.robot, self.actuators)
        laws, structures = self.laws, self.structures
        return database(self.robot.name, structures, laws, MODES, limits, self.timeline)

    def packets(self, log: FlightLog, writer: PacketWriter | None = None) -> Iterator[bytes]:
        """Yield the packets of a log, or of a part of it with the ``writer`` of the part before."""
        writer = writer or PacketWriter(self.structures)
        for start, stop in block_bounds(log.ticks):
            rows = log.rows(start, stop)
            columns, first = log_columns(rows, self.laws), rows.first_tick
            events = log_events(rows, self.laws)
            yield from writer.packets(first, first + rows.ticks, columns, events)


def check_libraries(*others: str) -> None:
    """Check that what writes packets and databases is installed, and modules of ``others``.

    Raises:
        InputError: one is not.
    """
    try:
        for module in ("spacepackets", "yamcs.pymdb", *others):
            import_module(module)
    except ImportError as error:
        raise InputError(f"telemetry needs {error.name}: `{install_command('ground')}`") from None


def database_path(destination: str) -> Path:
    """Return where the database of the packets to a destination is written.

    Beside a file; for UDP in the folder for temporary files, where the ground display of this
    machine looks for it.

    Raises:
        InputError: there would be one name for both.
    """
    if not destination.startswith("udp:"):
        path = Path(destination)
        if path.suffix == DATABASE:
            raise InputError(f"{path}: that is the name of the packets' database: take another")
        return path.with_suffix(DATABASE)
    _, port = parse_udp(destination)
    return Path(tempfile.gettempdir()) / f"space_robot_telemetry_{port}{DATABASE}"


def prepare_telemetry(flight: Flight) -> Path | None:
    """Write the database of a flight's telemetry, and empty its file; return the database's path.

    None: the flight sends none.

    Raises:
        InputError: a library is missing, or something cannot be written.
    """
    destination = flight.controller_settings.telemetry
    if not destination:
        return None
    database = TelemetryPlan.of_flight(flight).database
    path = database_path(destination)
    if not destination.startswith("udp:"):
        write_text("", Path(destination), replace=True)
    write_text(database, path, replace=True)
    return path


def telemetry_remark(flight: Flight, database: Path) -> str:
    """Return what a user should know of the telemetry before the flight."""
    return f"telemetry to {flight.controller_settings.telemetry}; database: {database}"


@contextmanager
def telemetry_of(flight: Flight) -> Iterator[Callable[[FlightLog], None]]:
    """Open the telemetry of a flight in this process; yield what sends that of a part of its log.

    It does nothing if the flight sends none.
    """
    if prepare_telemetry(flight) is None:
        yield lambda log: None
        return
    plan = TelemetryPlan.of_flight(flight)
    writer, sink = PacketWriter(plan.structures), open_sink(flight.controller_settings.telemetry)
    try:
        yield lambda log: sink.writelines([*plan.packets(log, writer)])
    finally:
        sink.close()


@contextmanager
def live_telemetry(flight: Flight) -> Iterator[Report | None]:
    """Open the telemetry of a flight whose controller answers message by message."""
    prepare_telemetry(flight)
    names, settings = flight.controller.names, flight.controller_settings
    if (telemetry := LiveTelemetry.from_settings(settings, names, tuple(flight.laws))) is None:
        yield None
        return
    try:
        yield telemetry.report
    finally:
        telemetry.close()


def signal_limits(
    robot: Robot, actuators: BaseActuatorSettings
) -> Mapping[str, Sequence[tuple[float, float]]]:
    """Return lowest and highest values of signals: limits of joints and wheels."""
    joints, base = robot.limits, [(-np.inf, np.inf)] * 3
    limits: dict[str, Sequence[tuple[float, float]]] = {
        "joint_positions": [(each.lower, each.upper) for each in joints],
        "joint_velocities": [(-each.velocity, each.velocity) for each in joints],
        "applied_torque": [*base, *((-each.effort, each.effort) for each in joints)],
    }
    wheels = actuators.wheels
    if count := actuators.wheel_count:
        torques, momenta = wheels.values("max_torque"), wheels.values("max_momentum")
        speeds = momenta / wheels.values("rotor_inertia")
        for name, largest in (("wheel_torques", torques), ("wheel_velocities", speeds)):
            ends = [float(value) or np.inf for value in np.broadcast_to(largest, count)]
            limits[name] = [(-end, end) for end in ends]
    return limits


def _timeline(texts: Sequence[str]) -> list[tuple[float, str]]:
    matches = filter(None, (EVENT.match(str(text)) for text in texts))
    return sorted((float(match[2]), match[1].replace("_", " ")) for match in matches)
