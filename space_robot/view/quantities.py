"""Quantities of a flight that are plotted beside its scene."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import SOURCES

from ..analysis.attitude_drift import attitude_drift, controls_base
from ..analysis.described import assumed_robot_of, flown_actuators
from ..analysis.figures.overlay import words
from ..analysis.metrics import error_columns, torque_columns, tracking_error, unit_of
from ..analysis.tool_error import ToolError, leads_tool

Array = NDArray[np.float64]

AXES = "xyz"


class PlottedQuantity(NamedTuple):
    """Values with a common unit over the ticks of a flight."""

    title: str
    unit: str
    labels: Sequence[str]
    values: Array
    """(N, len(labels))."""
    is_error: bool = False
    are_pulses: bool = False
    """True for duty cycles per tick, from 0 to 1."""


def quantities_of(log: FlightLog, robot: Robot) -> list[PlottedQuantity]:
    """Return errors, drift of the base, joints, torques, actuators and surroundings of a flight.

    Args:
        log: the flight.
        robot: with the joints of ``log``.
    """
    return [
        *_errors(log),
        *_tool(log, robot),
        *_drift(log),
        *_passive_joints(log, robot),
        *_gears(log, robot),
        *_torques(log),
        *_actuators(log),
        *_surroundings(log),
    ]


def _errors(log: FlightLog) -> Iterator[PlottedQuantity]:
    columns = error_columns(log.axes, controls_base(log), log.prismatic, log.branches)
    names, values = np.array([*AXES, *log.joint_names]), tracking_error(log)
    for name, axes in columns.items():
        unit = unit_of(name).strip("-")
        yield PlottedQuantity(
            f"{words(name)} error", unit, names[axes].tolist(), values[:, axes], True
        )


def _tool(log: FlightLog, robot: Robot) -> Iterator[PlottedQuantity]:
    """Yield the distance of the tool from its path, of a mission that leads it."""
    if not leads_tool(log):
        return
    with suppress(InputError):  # the bag does not tell what the flight software assumed
        errors = ToolError(log, robot, assumed_robot_of(log)).errors(log)
        yield PlottedQuantity("tool error", "m", ["distance"], errors[:, :1], True)


def _torques(log: FlightLog) -> Iterator[PlottedQuantity]:
    columns = torque_columns(log.axes, controls_base(log), log.prismatic, log.branches)
    names = np.array([*AXES, *log.joint_names])
    for name, axes in columns.items():
        yield PlottedQuantity(
            words(name), unit_of(name), names[axes].tolist(), log.applied_torque[:, axes]
        )


def _drift(log: FlightLog) -> Iterator[PlottedQuantity]:
    """Yield the distance of the base from its first known position."""
    known = np.flatnonzero(log.finite(("base_position", "quaternion")))
    if not len(known):
        return
    first = known[0]
    if not controls_base(log):
        turned = attitude_drift(log, log.quaternion[first])
        yield PlottedQuantity("attitude drift", "deg", AXES, turned)
    yield PlottedQuantity("base drift", "m", AXES, log.base_position - log.base_position[first])


def _passive_joints(log: FlightLog, robot: Robot) -> Iterator[PlottedQuantity]:
    """Yield the deflection of the passive joints from the rest positions of their springs."""
    rest = np.array([spring.rest for spring in robot.springs])
    slides = np.array(log.prismatic[len(log.joint_names) :], dtype=bool)
    for chosen, unit in ((~slides, "rad"), (slides, "m")):
        if chosen.any():
            names = np.array(log.passive_names)[chosen].tolist()
            away = (log.passive_positions - rest)[:, chosen]
            yield PlottedQuantity("deflection", unit, names, away)


def _gears(log: FlightLog, robot: Robot) -> Iterator[PlottedQuantity]:
    """Yield how far the motors behind gears are ahead of their joints, where both are known."""
    has_truth = log.measured is not None
    joints = [
        joint
        for joint, name in enumerate(log.joint_names)
        if name in log.geared_names and (has_truth or not _is_motors_encoder(robot, joint))
    ]
    motors = [log.geared_names.index(log.joint_names[joint]) for joint in joints]
    slides = np.array(log.prismatic, dtype=bool)[joints]
    away = log.motor_positions[:, motors] - log.joint_positions[:, joints]
    for chosen, unit in ((~slides, "rad"), (slides, "m")):
        if chosen.any():
            names = np.array(log.joint_names)[joints][chosen].tolist()
            yield PlottedQuantity("gear deflection", unit, names, away[:, chosen])


def _is_motors_encoder(robot: Robot, joint: int) -> bool:
    """Return True if a joint's measured position is its motor's."""
    gear = robot.gears[joint] if robot.gears else None
    return gear is None or gear.encoder == "motor"


def _surroundings(log: FlightLog) -> Iterator[PlottedQuantity]:
    """Yield the torques from outside that act in orbit, inertial axes, and the magnetic field."""
    if not log.external_torques.shape[1]:
        return
    for number, source in enumerate(SOURCES):
        torque = log.external_torques[:, 3 * number : 3 * number + 3]
        if np.nan_to_num(torque).any():
            yield PlottedQuantity(f"{words(source)} torque", "N m", AXES, torque)
    if np.nan_to_num(log.magnetic_field).any():
        yield PlottedQuantity("magnetic field", "T", AXES, log.magnetic_field)


def _actuators(log: FlightLog) -> Iterator[PlottedQuantity]:
    wheels, thrusters = log.wheel_velocities.shape[1], log.thrusts.shape[1]
    if not wheels and not thrusters:
        return
    names = [f"wheel_{k + 1}" for k in range(wheels)]
    try:
        actuators = flown_actuators(log)
    except InputError:  # the bag does not describe them
        if wheels:
            yield PlottedQuantity("wheel speed", "rad/s", names, log.wheel_velocities)
        largest = np.nanmax(np.abs(log.thrusts), axis=0, initial=0.0)
        force = np.where(largest > 0.0, largest, 1.0)
    else:
        if wheels:
            held = actuators.wheels.spin_momenta(log.wheel_velocities)
            yield PlottedQuantity("wheel momentum", "N m s", names, held)
        force = actuators.thrusters.values("force")
    if thrusters:
        names = [f"thruster_{k + 1}" for k in range(thrusters)]
        yield PlottedQuantity("thruster pulses", "", names, log.thrusts / force, are_pulses=True)
