"""Torques on the robot from outside, by source: of the orbit, the sines of (61), the user's own."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from space_robot_model.elementary.matrices import Array, norms, unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.placements import base_axes, cross, to_inertial
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import SOURCES
from space_robot_sim.environment.captures import Captures
from space_robot_sim.environment.disturbance import DisturbanceSettings, LoadSchedule

from .analysed_log import AnalysedLog
from .described import flown_captures, plant_settings
from .series import Definition, TimeSeries, series

SINES = "sines"
"""Name of the disturbance (61) among the sources."""
OWN = "own"
"""Name of the user's own disturbance among them."""


@series(
    "disturbance torque",
    {
        "disturbance_*": Definition("N m", "torque of the source about the common centre of mass"),
        "impulse_*": Definition(
            "N m s", "angular momentum that the source has given since the first tick", ("max",)
        ),
    },
)
def disturbance(flight: AnalysedLog) -> TimeSeries | None:
    """Return size and impulse of each source in an orbit.

    The impulse is what wheels have to store if nothing unloads them.
    """
    log = flight.log
    if not log.orbit_position.shape[1]:
        return None
    sources = torques_by_source(log)
    impulses = dict.fromkeys(sources, np.zeros(3))

    def values(start: int, stop: int) -> Array:
        torques = {name: torque(start, stop) for name, torque in sources.items()}
        sizes = [norms(torque) for torque in torques.values()]
        for name, torque in torques.items():
            impulse = impulses[name] + log.timebase.period * np.cumsum(torque, axis=0)
            impulses[name] = impulse[-1].copy()
            sizes.append(norms(impulse))
        return np.column_stack(sizes)

    names = [f"{kind}_{name}" for kind in ("disturbance", "impulse") for name in sources]
    return TimeSeries({name: [k] for k, name in enumerate(names)}, values)


def torques_by_source(log: FlightLog) -> dict[str, Callable[[int, int], Array]]:
    """Return a function from rows to the torque (N, 3) of each source after each tick, N m.

    Inertial axes, about the common centre of mass, over the interval after the tick.
    """
    settings = plant_settings(log).disturbance
    captures = flown_captures(log) if settings.table else None
    torques: dict[str, Callable[[int, int], Array]] = {}
    for k, name in enumerate(SOURCES):
        torques[name] = lambda a, b, k=k: log.external_torques[a:b, 3 * k : 3 * k + 3]  # type: ignore[misc]
    if settings.scale:
        torques[SINES] = lambda a, b: _sines(log.rows(a, b), settings)
    if captures is not None:
        torques[OWN] = lambda a, b: _own_torque(log.rows(a, b), settings, captures)
    return torques


def _sines(log: FlightLog, settings: DisturbanceSettings) -> Array:
    waves = np.array(settings.base_frequencies)[:, np.newaxis] * (2.0 * np.pi * log.time)
    sine = -settings.scale * settings.base_amplitude * np.sin(waves).sum(axis=0)
    return np.repeat(sine[:, np.newaxis], 3, axis=1)


def base_loads(log: FlightLog, disturbance: DisturbanceSettings) -> tuple[Array, Array]:
    """Return force and torque (N, 6) of the user's own disturbance on the base, base frame.

    At the begin and at the end of the interval after each tick, N and N m.
    """
    schedule = LoadSchedule.of(disturbance, log.joint_names, log.timebase.period)
    begin, end = schedule.over(np.arange(log.first_tick, log.first_tick + log.ticks))
    return begin[:, :6], end[:, :6]


def body_axes(log: FlightLog) -> Array:
    """Return the base's axes on inertial ones, (3, 3, N), see `base_axes`."""
    return base_axes(unit_rows(log.quaternion).T)


def torque_about_centre(axes: Array, centre_of_mass: Array, force: Array, torque: Array) -> Array:
    """Return the torque (N, 3) about the common centre of mass, inertial axes, N m.

    Args:
        axes: (3, 3, N) of the base, see `base_axes`.
        centre_of_mass: (N, 3) from that of the base, inertial axes, m.
        force: (N, 3) at the base's centre of mass, base frame, N.
        torque: (N, 3) on the base, base frame, N m.
    """
    pushed, turned = to_inertial(axes, force.T), to_inertial(axes, torque.T)
    return (turned - cross(centre_of_mass.T, pushed)).T


def _own_torque(log: FlightLog, disturbance: DisturbanceSettings, captures: Captures) -> Array:
    loads, stop = base_loads(log, disturbance)[0], log.first_tick + log.ticks
    ticks = [log.first_tick, *captures.ticks(log.first_tick + 1, stop), stop]
    centres = []
    for begin, end in pairwise(ticks):  # between captures and releases the robot is the same
        rows = log.rows(begin - log.first_tick, end - log.first_tick)
        centres.append(centre_of_mass(captures.robot_at(begin), rows))
    return torque_about_centre(body_axes(log), np.concatenate(centres), loads[:, :3], loads[:, 3:])


def centre_of_mass(robot: Robot, log: FlightLog) -> Array:
    """Return the common centre of mass (N, 3) from the base's, inertial axes, m."""
    quaternion = unit_rows(log.quaternion)
    motion = Motion(quaternion, log.omega_base, log.all_positions, log.all_velocities)
    return robot_momentum(robot, motion).centre_of_mass
