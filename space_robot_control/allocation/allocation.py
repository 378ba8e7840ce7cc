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
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.algebra import subtract, vector
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_msgs_py.compiled.kernels import RecordFunction, kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, assign, nested, shaped
from space_robot_msgs_py.samples import MOST_ACTUATORS, MOST_WHEELS

from .settings import AllocationSettings
from .thrusters import AssumedThrusters, expect_torque, modulate
from .unloading import AssumedTorquers, Unloading, dump_momentum, find_unloading
from .wheels import AssumedWheels, command_wheels, observe_wheels, stored_momentum

Array = NDArray[np.float64]


class Allocation(Record):
    """Settings and memory of the allocation."""

    is_used: float = shaped(lambda n: (), "0: the base's actuators are ideal, or there are none")
    wheels: AssumedWheels = nested(AssumedWheels)
    thrusters: AssumedThrusters = nested(AssumedThrusters)
    torquers: AssumedTorquers = nested(AssumedTorquers)
    unloading: Unloading = nested(Unloading)
    thruster_demand: Array = shaped(lambda n: (3,), "Torque demanded of the thrusters, N m")
    expected: Array = shaped(lambda n: (3,))
    """Torque expected of the thrusters from the present tick to the next, N m."""
    demand: Array = shaped(lambda n: (3,), "Torque demanded of the base, N m, base frame")
    reported_speeds: Array = shaped(lambda n: (MOST_WHEELS,))
    """Speeds of the wheels at the present tick, rad/s."""
    reported_torques: Array = shaped(lambda n: (MOST_WHEELS,))
    """Torques of the wheels' motors since the last tick, N m."""
    command: Array = shaped(lambda n: (MOST_ACTUATORS,))
    """Torque of each wheel's motor, N m, force of each thruster, N, dipole of each magnetic
    torquer, A m2."""

    @classmethod
    def build(
        cls, n: int, assumed: BaseActuatorSettings, settings: AllocationSettings, period: float
    ) -> Allocation:
        """Build from the settings for a robot of ``n`` joints and ticks of ``period``, s."""
        allocation = cls.allocate(n)
        assign(
            allocation,
            is_used=bool(assumed.names),
            wheels=AssumedWheels.build(n, assumed.wheels, settings, period),
            thrusters=AssumedThrusters.build(n, assumed.thrusters, settings, period),
            torquers=AssumedTorquers.build(n, assumed.magnetic_torquers, settings),
            unloading=Unloading.build(n, settings),
        )
        return allocation


@kernel
def allocate(allocation: Allocation, tick: float) -> None:
    """Write the ``command`` that gives the base what is demanded from ``tick`` to the next.

    ``demand``, what the wheels report at ``tick`` and the magnetic field are read.
    """
    wheels, thrusters, torquers = allocation.wheels, allocation.thrusters, allocation.torquers
    command, wheel_count = allocation.command, int(wheels.count)
    thruster_count = int(thrusters.count)
    if wheel_count > 0:
        observe_wheels(wheels, tick, allocation.reported_speeds, allocation.reported_torques)
    # thrusters and torquers first: the wheels give what these are not expected to give
    if thruster_count > 0:
        _allocate_thrusters(allocation, int(tick))
        for j in range(thruster_count):
            command[wheel_count + j] = thrusters.is_open[j] * thrusters.force[j]
    if wheel_count > 0:
        demand = subtract(vector(allocation.demand, 0), vector(allocation.expected, 0))
        if torquers.count > 0.0:
            dump_momentum(torquers, stored_momentum(wheels))
            demand = subtract(demand, vector(torquers.torque, 0))
            for j in range(int(torquers.count)):
                command[wheel_count + thruster_count + j] = torquers.dipole[j]
        command_wheels(wheels, tick, demand)
        for k in range(wheel_count):
            command[k] = wheels.torque[k]


@subroutine
def _allocate_thrusters(allocation: Allocation, tick: int) -> None:
    wheels, demand = allocation.wheels, allocation.thruster_demand
    find_unloading(allocation.unloading, wheels, demand)
    # of axes that no healthy wheel turns, thrusters have all of the demand
    if wheels.healthy.rank < 3.0:
        for i in range(3):
            for j in range(3):
                demand[i] += wheels.healthy.beyond[i, j] * allocation.demand[j]
    for i in range(3):
        if not np.isfinite(demand[i]):  # it would stay in the impulse owed for good
            demand[i] = 0.0
    modulate(allocation.thrusters, tick, demand)
    expect_torque(allocation.thrusters, tick, allocation.expected)


@kernel
def leave_alone(allocation: Allocation, tick: float) -> None:
    """Do nothing: allocation of a base without actuator hardware."""


@cache
def allocation_code(is_used: bool) -> RecordFunction:
    """Return `allocate`, or an empty function without hardware, for compiled loops."""
    # as a value it is compiled once, and not into every loop; without hardware not at all
    record = (Allocation,)
    return RecordFunction(allocate if is_used else leave_alone, record, record)


class Diagnosis(NamedTuple):
    """Health of the base's actuators, as the allocation sees it."""

    failed: tuple[str, ...] = ()
    """Names of the wheels excluded from the allocation."""
    summary: str = ""
    """One-line summary; empty without problems."""
    values: dict[str, float | int | str] = {}  # noqa: RUF012 (never written)
    """Values for diagnostics; empty without allocation."""


def diagnose(allocation: Allocation) -> Diagnosis:
    """Return the diagnosis from the allocation's memory."""
    if allocation.is_used == 0.0:
        return Diagnosis()
    wheels, thrusters, torquers = allocation.wheels, allocation.thrusters, allocation.torquers
    count, rank = int(wheels.count), int(wheels.healthy.rank)
    members = wheels.healthy.takes_part[:count]
    failed = tuple(f"wheel_{k + 1}" for k in np.flatnonzero(members == 0.0))
    values: dict[str, float | int | str] = {}
    if count:
        shares = np.abs(wheels.momentum[:count]) / wheels.max_momentum[:count]
        values |= {
            "wheel_axes": rank,
            "fullest_wheel": float(shares.max()),
            "demand_scaled_ticks": int(wheels.scaled_ticks),
            "wheel_full_ticks": int(wheels.full_ticks),
        }
    summary = ""
    if failed:
        values["failed"] = ", ".join(failed)
        summary = f"{values['failed']} failed, left out"
        if rank < 3:
            others = "thrusters take the others"
            rest = others if thrusters.count else "the base is not controlled fully"
            summary += f": wheels turn {rank} of 3 axes, {rest}"
    if thrusters.count:
        values["pulses"] = int(thrusters.pulses.sum())
    if thrusters.count and count:
        values["unloading"] = "yes" if allocation.unloading.is_active else "no"
    if torquers.count:
        values["largest_dipole"] = float(np.abs(torquers.dipole).max())
    return Diagnosis(failed, summary, values)
