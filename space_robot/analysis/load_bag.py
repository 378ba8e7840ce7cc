"""Reading a recorded flight, and a part of it by time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError


def load_bag(
    path: str | Path, remap: Mapping[str, str] | None = None, namespace: str | None = None
) -> FlightLog:
    """Read a recorded flight as NumPy arrays, one row a tick.

    Some of its fields, for N ticks and n joints:

    - ``time`` (N,) s, simulated
    - ``quaternion`` (N, 4) ``[w, x, y, z]``, the base's attitude in the inertial frame
    - ``angular_velocity`` (N, 3) rad/s, in the base frame
    - ``base_position`` (N, 3) m and ``base_velocity`` (N, 3) m/s, in the inertial frame
    - ``joint_positions`` (N, n) rad and ``joint_velocities`` (N, n) rad/s
    - ``applied_torque`` (N, n+3) N m over the interval that ended at the tick: base x, y, z in the
      base frame, then the joints
    - ``commanded_torque`` (N, n+3) N m, the answer to the tick; None if not recorded
    - ``reference_joints`` (N, 3, n) desired position, velocity, acceleration: rad, rad/s, rad/s2
    - ``reference_base`` (N, 10) desired quaternion ``[w, x, y, z]``, angular velocity rad/s and
      acceleration rad/s2, in the base frame
    - ``joint_names``, and ``description``: what was flown (controller, case, gains, ...)
    - ``damage``, ``unfinished``, ``lost``: what is wrong with the bag, empty or zero if nothing.
      Ticks that could not be read are NaN; ``whole`` (N,) says which are not.

    Args:
        path: the bag's folder, or a single .mcap or .db3 file.
        remap: our topic by the bag's, as in ``{"/arm/joint_states": "/joint_states"}``.
        namespace: of the robot to be read, as ``/sat1``; None: of the only one in the bag.

    Raises:
        InputError: no bag is there, or no flight in it; one line says why.
    """
    from space_robot_msgs_py.bag.reader import read_flight
    from space_robot_msgs_py.config.arguments import as_path

    return read_flight(as_path(path, "path"), remap, namespace=namespace)


ROUNDING = 1e-6
"""Ticks by which a time may miss the tick it means."""


def excerpt(log: FlightLog, from_s: float | None, to_s: float | None) -> FlightLog:
    """Return the ticks with ``from_s <= t < to_s``, views into the arrays of ``log``.

    What was lost or filled is not known by time: these counts stay those of the whole flight.
    Unanswered ticks are counted anew where the commands are known.

    Args:
        log: a flight.
        from_s: s (None: from its start).
        to_s: s (None: to its end).

    Raises:
        InputError: the times are reversed, outside the flight, or hold not one tick.
    """
    if from_s is None and to_s is None:
        return log
    period = log.timebase.period
    begin, end = log.first_tick * period, (log.first_tick + log.ticks) * period
    low, high = begin if from_s is None else from_s, end if to_s is None else to_s
    limits = " ".join(
        f"--{name} {value:g}"
        for name, value in (("from", from_s), ("to", to_s))
        if value is not None
    )
    if low >= high and None not in (from_s, to_s):
        raise InputError(f"{limits}: the start must come before the end")
    if not (begin - ROUNDING * period <= low < end and begin < high <= end + ROUNDING * period):
        raise InputError(f"{limits}: outside the flight, which lasts from {begin:g} to {end:g} s")
    first, stop = (math.ceil(t / period - ROUNDING) - log.first_tick for t in (low, high))
    if first >= stop:
        raise InputError(f"{limits}: no tick lies between (one every {period:g} s)")
    cut = log.rows(first, stop)
    if cut.commanded_torque is not None:
        cut.unanswered = int(np.count_nonzero(np.isnan(cut.commanded_torque[:, 0])))
    return cut
