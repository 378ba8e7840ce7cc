"""A user's own disturbance: a wrench on the base and torques on the joints, linear in time.

Over a tick each number is ``value + slope (t - begin)``, so that the stages of the integrator have
it at their own times. The record holds the segments of some ticks at a time; the plant's
`LoadSchedule` writes the next ones when they are due.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import any_lane, where
from space_robot_msgs_py.compiled.records import Record, shaped

Array = NDArray[np.float64]

SEGMENTS = 64
"""Segments that the record has room for."""


class PrescribedLoads(Record):
    """Force (N) and torque (N m) on the base, base frame, then torques on the actuated joints."""

    is_on: float = shaped(lambda n: (), uniform=True)
    """1 with a disturbance of the user's own, else 0."""
    first: Array = shaped(lambda n: (SEGMENTS + 1,))
    """First tick of each segment, rising; inf for one that is not used."""
    values: Array = shaped(lambda n: (SEGMENTS, 6 + n))
    """Loads at the first tick of each segment, N and N m."""
    slopes: Array = shaped(lambda n: (SEGMENTS, 6 + n))
    """Their rates of change, 1/s."""
    begin: Array = shaped(lambda n: (1,))
    """s; begin of the segment of the present tick."""
    value: Array = shaped(lambda n: (6 + n,))
    """Loads then."""
    slope: Array = shaped(lambda n: (6 + n,))
    """Their rates of change."""
    actuation: Array = shaped(lambda n: (6,))
    """What the actuators give over the tick: force and torque on the base, base frame."""


@kernel
def begin_loads(loads: PrescribedLoads, tick: int, period: float, actuation: Array) -> None:
    """Choose the segment of ``tick``, which lasts ``period`` s.

    ``actuation``: (6,) what the actuators give over the tick, see `PrescribedLoads`.
    """
    for i in range(6):
        loads.actuation[i] = actuation[i]
    for k in range(SEGMENTS):
        is_present = (loads.first[k] <= 1.0 * tick) & (1.0 * tick < loads.first[k + 1])
        if any_lane(is_present):
            loads.begin[0] = where(is_present, loads.first[k] * period, loads.begin[0])
            for i in range(loads.value.size):
                loads.value[i] = where(is_present, loads.values[k, i], loads.value[i])
                loads.slope[i] = where(is_present, loads.slopes[k, i], loads.slope[i])


@kernel
def add_loads(loads: PrescribedLoads, time: float, wrench: Array, disturbance: Array) -> None:
    """Add the loads at ``time`` (s) within the present tick.

    Args:
        loads: of the robot.
        time: s.
        wrench: (6,) becomes the sum of what the actuators give and the loads on the base.
        disturbance: (n+3,) N m, opposes motion; loads on joints are taken from it.
    """
    since = time - loads.begin[0]
    for i in range(6):
        wrench[i] = loads.actuation[i] + (loads.value[i] + loads.slope[i] * since)
    for i in range(6, loads.value.size):
        disturbance[i - 3] -= loads.value[i] + loads.slope[i] * since
