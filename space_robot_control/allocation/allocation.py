"""Allocation of the base torque to its actuators in one tick.

    demand --+--> wheels --> motors' torques (and null motion)
             |      ^ less the torque expected of the thrusters
             |      ^ less the torque expected of the magnetic torquers, which unload them
             +--> what the wheels' axes cannot give, and unloading --> thrusters --> pulses

A base without wheels leaves all to the thrusters. What was given comes back in the reported
torque, so the time-delay estimate is not misled by limits, failures or pulses.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_msgs_py.compiled.kernels import RecordFunction, kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, assign, nested, shaped
from space_robot_msgs_py.samples import MOST_THRUSTERS, MOST_TORQUERS, MOST_WHEELS

from .magnetic_torquers import AssumedTorquers, dump_momentum
from .modulation import Modulation, modulate
from .null_motion import NullMotion, add_null_motion
from .settings import AllocationSettings
from .thrusters import AssumedThrusters, expect_torque
from .wheel_health import WheelHealth, observe_wheels, remember_asked
from .wheels import AssumedWheels, share_torque, stored_momentum

Array = NDArray[np.float64]


WHEELS_SHARE = 0.5
"""Share of the wheels' torque available to unloading."""


class Unloading(Record):
    """Settings and state of the unloading."""

    above: float = shaped(lambda n: ())
    to: float = shaped(lambda n: ())
    """Share of the largest momentum at which unloading stops."""
    rate: float = shaped(lambda n: ())
    """1/s."""
    is_active: float = shaped(lambda n: ())
    """0 or 1."""

    @classmethod
    def build(cls, n: int, settings: AllocationSettings) -> Unloading:
        """Read the settings."""
        unloading = cls.allocate(n)
        assign(
            unloading,
            above=settings.unload_above if settings.thrusters_unload else np.inf,
            to=settings.unload_to,
            rate=1.0 / settings.unload_time,
        )
        return unloading


@kernel
def find_unloading(unloading: Unloading, wheels: AssumedWheels, torque: Array) -> None:
    """Write the unloading ``torque`` (3,) N m for the thrusters, zero if inactive."""
    x, y, z = stored_momentum(wheels)
    fullest = 0.0
    for k in range(int(wheels.count)):
        fullest = max(fullest, abs(wheels.momentum[k]) / wheels.max_momentum[k])
    if fullest > unloading.above:
        unloading.is_active = 1.0
    elif fullest < unloading.to:
        unloading.is_active = 0.0
    rate, excess = unloading.rate * unloading.is_active, 1.0
    for k in range(int(wheels.count)):
        row = wheels.healthy.inverse[k]
        load = abs(row[0] * x + row[1] * y + row[2] * z) * rate
        excess = max(excess, load / (WHEELS_SHARE * wheels.max_torque[k]))
    torque[0] = -rate / excess * x
    torque[1] = -rate / excess * y
    torque[2] = -rate / excess * z


class Allocation(Record):
    """Settings and memory of the allocation."""

    is_used: float = shaped(lambda n: ())
    """0: the base's actuators are ideal, or there are none."""
    wheels: AssumedWheels = nested(AssumedWheels)
    health: WheelHealth = nested(WheelHealth)
    null_motion: NullMotion = nested(NullMotion)
    thrusters: AssumedThrusters = nested(AssumedThrusters)
    torquers: AssumedTorquers = nested(AssumedTorquers)
    modulation: Modulation = nested(Modulation)
    unloading: Unloading = nested(Unloading)
    of_thrusters: Array = shaped(lambda n: (3,))
    """Torque demanded of the thrusters, N m."""
    expected: Array = shaped(lambda n: (3,))
    """Torque expected of the thrusters from the present tick to the next, N m."""
    of_wheels: Array = shaped(lambda n: (3,))
    """Torque demanded of the wheels, N m."""
    demand: Array = shaped(lambda n: (3,))
    """Torque demanded of the base, N m, base frame."""
    reported_speeds: Array = shaped(lambda n: (MOST_WHEELS,))
    """Speeds of the wheels at the present tick, rad/s."""
    reported_torques: Array = shaped(lambda n: (MOST_WHEELS,))
    """Torques of the wheels' motors since the last tick, N m."""
    command: Array = shaped(lambda n: (MOST_WHEELS + MOST_THRUSTERS + MOST_TORQUERS,))
    """Torque of each wheel's motor, N m, force of each thruster, N, dipole of each magnetic
    torquer, A m2."""

    @classmethod
    def build(
        cls, n: int, assumed: BaseActuatorSettings, settings: AllocationSettings, period: float
    ) -> Allocation:
        """Build from the settings for a robot of ``n`` joints and ticks of ``period``, s."""
        allocation = cls.allocate(n)
        thrusters = AssumedThrusters.build(n, assumed.thrusters, settings, period)
        assign(
            allocation,
            is_used=bool(assumed.names),
            thrusters=thrusters,
            wheels=AssumedWheels.build(n, assumed.wheels, settings, period),
            health=WheelHealth.build(n, settings),
            null_motion=NullMotion.build(n, settings),
            torquers=AssumedTorquers.build(n, assumed.magnetic_torquers, settings),
            modulation=Modulation.build(n, thrusters, settings, period),
            unloading=Unloading.build(n, settings),
        )
        return allocation


@kernel
def allocate(allocation: Allocation, tick: float) -> None:
    """Write the ``command`` that gives the base what is demanded from ``tick`` to the next.

    ``demand``, what the wheels report at ``tick`` and the magnetic field are read.
    """
    wheels, thrusters, command = allocation.wheels, allocation.thrusters, allocation.command
    wheel_count, thruster_count = int(wheels.count), int(thrusters.count)
    torquers = allocation.torquers
    if wheel_count > 0:
        observe_wheels(
            allocation.health, wheels, tick, allocation.reported_speeds, allocation.reported_torques
        )
    if thruster_count > 0:
        _allocate_thrusters(allocation, int(tick))
        for j in range(thruster_count):
            command[wheel_count + j] = thrusters.is_open[j] * thrusters.force[j]
    if wheel_count > 0:
        for i in range(3):
            allocation.of_wheels[i] = allocation.demand[i] - allocation.expected[i]
        if torquers.count > 0.0:
            x, y, z = stored_momentum(wheels)
            dump_momentum(torquers, x, y, z)
            for i in range(3):
                allocation.of_wheels[i] -= torquers.torque[i]
            for j in range(int(torquers.count)):
                command[wheel_count + thruster_count + j] = torquers.dipole[j]
        share_torque(wheels, allocation.of_wheels)
        add_null_motion(allocation.null_motion, wheels)
        remember_asked(allocation.health, wheels, tick)
        for k in range(wheel_count):
            command[k] = wheels.torque[k]


@subroutine
def _allocate_thrusters(allocation: Allocation, tick: int) -> None:
    wheels, demand = allocation.wheels, allocation.of_thrusters
    find_unloading(allocation.unloading, wheels, demand)
    if wheels.healthy.rank < 3.0:
        for i in range(3):
            for j in range(3):
                demand[i] += wheels.healthy.beyond[i, j] * allocation.demand[j]
    for i in range(3):
        if not np.isfinite(demand[i]):  # no law's accident is to be owed for good
            demand[i] = 0.0
    modulate(allocation.modulation, allocation.thrusters, tick, demand)
    expect_torque(allocation.thrusters, tick, allocation.expected)


@kernel
def leave_alone(allocation: Allocation, tick: float) -> None:
    """Do nothing: allocation of a base without actuator hardware."""


@cache
def allocation_code(is_used: bool) -> RecordFunction:
    """Return `allocate`, or an empty function without hardware, for compiled loops.

    Given as a value it is compiled once, and not into every loop; without hardware not at all.
    """
    record = (Allocation,)
    return RecordFunction(allocate if is_used else leave_alone, record, record)
