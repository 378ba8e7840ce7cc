"""Quantities of a flight that are plotted beside its scene."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import SOURCES

from ..analysis.described import flown_actuators
from ..analysis.errors import (
    attitude_angles,
    attitude_drift,
    controls_base,
    error_columns,
    groups_of,
    torque_columns,
    tracking_error,
)
from ..analysis.measure import column_label, column_unit
from ..analysis.tool_path import ToolPath, leads_tool
from .plotted_quantity import AXES, PlottedQuantity
from .state_quantities import by_unit, estimates, momentum, motion

Array = NDArray[np.float64]


def quantities_of(log: FlightLog, robot: Robot) -> list[PlottedQuantity]:
    """Return errors, drift of the base, joints, torques, actuators and surroundings of a flight.

    Args:
        log: the flight.
        robot: with the joints of ``log``.
    """
    return [
        *_errors(log),
        *_tool(log),
        *_drift(log),
        *motion(log),
        *_passive_joints(log, robot),
        *_gears(log, robot),
        *_torques(log),
        *_actuators(log),
        *momentum(log),
        *estimates(log),
        *_surroundings(log),
    ]


def _errors(log: FlightLog) -> Iterator[PlottedQuantity]:
    columns = error_columns(groups_of(log))
    names, values = np.array([*AXES, *log.joint_names]), tracking_error(log)
    for name, axes in columns.items():
        if name == "attitude":
            angles = attitude_angles(log)
            yield PlottedQuantity("attitude", "attitude error", "deg", AXES, angles, True)
            continue
        yield PlottedQuantity(
            "joints",
            f"{column_label(name)} error",
            column_unit(name),
            names[axes].tolist(),
            values[:, axes],
            True,
        )


def _tool(log: FlightLog) -> Iterator[PlottedQuantity]:
    """Yield the distance of the tool from its path, of a mission that leads it."""
    if not leads_tool(log):
        return
    with suppress(InputError):  # the bag does not tell what the flight software assumed
        errors = ToolPath(log).errors(0, log.ticks)
        yield PlottedQuantity("tool", "tool error", "m", ["distance"], errors[:, :1], True)


def _torques(log: FlightLog) -> Iterator[PlottedQuantity]:
    columns = torque_columns(groups_of(log))
    names = np.array([*AXES, *log.joint_names])
    for name, axes in columns.items():
        yield PlottedQuantity(
            "torques",
            column_label(name),
            column_unit(name),
            names[axes].tolist(),
            log.applied_torque[:, axes],
        )


def _drift(log: FlightLog) -> Iterator[PlottedQuantity]:
    """Yield the distance of the base from its first known position."""
    known = np.flatnonzero(log.finite(("base_position", "quaternion")))
    if not len(known):
        return
    first = known[0]
    if not controls_base(log):
        turned = np.degrees(attitude_drift(log, log.quaternion[first]))
        yield PlottedQuantity("attitude", "attitude drift", "deg", AXES, turned)
    away = log.base_position - log.base_position[first]
    yield PlottedQuantity("base", "base drift", "m", AXES, away)


def _passive_joints(log: FlightLog, robot: Robot) -> Iterator[PlottedQuantity]:
    """Yield the deflection of the passive joints from the rest positions of their springs."""
    rest = np.array([spring.rest for spring in robot.springs])
    slides = log.prismatic[len(log.joint_names) :]
    away = log.passive_positions - rest
    yield from by_unit("deflection", "deflection", log.passive_names, slides, away)


def _gears(log: FlightLog, robot: Robot) -> Iterator[PlottedQuantity]:
    """Yield how far the motors behind gears are ahead of their joints, where both are known."""
    has_truth = log.measured is not None
    joints = [
        joint
        for joint, name in enumerate(log.joint_names)
        if name in log.geared_names and (has_truth or not _is_motors_encoder(robot, joint))
    ]
    motors = [log.geared_names.index(log.joint_names[joint]) for joint in joints]
    names = [log.joint_names[joint] for joint in joints]
    slides = [log.prismatic[joint] for joint in joints]
    away = log.motor_positions[:, motors] - log.joint_positions[:, joints]
    yield from by_unit("deflection", "gear deflection", names, slides, away)


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
            yield PlottedQuantity("orbit", f"{column_label(source)} torque", "N m", AXES, torque)
    if np.nan_to_num(log.magnetic_field).any():
        yield PlottedQuantity("orbit", "magnetic field", "T", AXES, log.magnetic_field)


def _actuators(log: FlightLog) -> Iterator[PlottedQuantity]:
    wheels, thrusters = log.wheel_velocities.shape[1], log.thrusts.shape[1]
    if not wheels and not thrusters:
        return
    names = [f"wheel_{k + 1}" for k in range(wheels)]
    is_described = True
    try:
        actuators = flown_actuators(log)
    except InputError:
        is_described = False
        largest = np.nanmax(np.abs(log.thrusts), axis=0, initial=0.0)
        force = np.where(largest > 0.0, largest, 1.0)
    else:
        if wheels:
            held = actuators.wheels.spin_momenta(log.wheel_velocities)
            yield PlottedQuantity("wheels", "wheel momentum", "N m s", names, held)
        force = actuators.thrusters.values("force")
    if wheels:
        speed, torque = log.wheel_velocities, log.wheel_torques
        yield PlottedQuantity(
            "wheels", "wheel speed", "rad/s", names, speed, is_shown=not is_described
        )
        yield PlottedQuantity("wheels", "wheel torque", "N m", names, torque, is_shown=False)
    if thrusters:
        names = [f"thruster_{k + 1}" for k in range(thrusters)]
        yield PlottedQuantity(
            "thrusters", "thruster pulses", "", names, log.thrusts / force, are_pulses=True
        )
