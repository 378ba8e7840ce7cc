"""Thrusters as the flight software knows them, and pulses for an impulse.

Pulses t_j s of thrusters with wrenches b_j give the base an impulse ``sum b_j t_j``. Those wanted
for an angular impulse are the non-negative least squares of it, the linear impulse beside it
weighed by ``weight times mean lever arm``: where the layout has pairs, they are pure couples. All
six components are in N m s, so.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import product
from space_robot_model.hardware.thrusters import ThrusterSettings
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, assign, nested, shaped
from space_robot_msgs_py.samples import MOST_THRUSTERS

from .non_negative import NonNegative, solve
from .settings import AllocationSettings

Array = NDArray[np.float64]

LONGEST_DELAY = 256
"""Longest modelled delay of a valve, ticks."""


class AssumedThrusters(Record):
    """Thrusters of one base as assumed by the flight software."""

    count: float = shaped(lambda n: ())
    period: float = shaped(lambda n: ())
    """Length of a tick, s."""
    force: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Of each open thruster, N."""
    wrench: Array = shaped(lambda n: (MOST_THRUSTERS, 6))
    """Of each open thruster: torque about the base's CoM, then its weighed force; N m, base
    frame."""
    shortest: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Ticks for which a valve stays open, 1 or more."""
    delay: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Ticks from a command to its valve."""
    peak: Array = shaped(lambda n: (2, 3))
    """Largest share of its time for which a thruster is open for a torque of 1 N m about +x, +y,
    +z, and about -x, -y, -z; 1/(N m)."""
    problem: NonNegative = nested(NonNegative)
    """Its solution: the time for which each thruster is wanted, s."""
    is_open: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """1 for each thruster that is to be open from the present tick to the next, else 0."""
    expected: Array = shaped(lambda n: (LONGEST_DELAY, 3))
    """Ring buffer of the torque expected from commands so far, by tick, N m."""

    @classmethod
    def build(
        cls, n: int, assumed: ThrusterSettings, settings: AllocationSettings, period: float
    ) -> AssumedThrusters:
        """Read the numbers of the settings; ``period`` of a tick in s."""
        thrusters, count = cls.allocate(n), assumed.count
        wrench = np.zeros((MOST_THRUSTERS, 6))
        size, shortest, delay = np.zeros((3, MOST_THRUSTERS))
        if count:
            torque, size[:count] = assumed.torques, assumed.values("force")
            shortest[:count] = np.maximum(1.0, assumed.ticks("shortest_pulse", period))
            delay[:count] = np.minimum(assumed.ticks("delay", period), LONGEST_DELAY - 1.0)
            arm = float(np.mean(np.linalg.norm(torque, axis=1) / size[:count]))
            force = assumed.unit_directions * size[:count, None]
            wrench[:count] = np.hstack([torque, settings.force_weight * arm * force])
        assign(
            thrusters,
            count=count,
            period=period,
            force=size,
            wrench=wrench,
            shortest=shortest,
            delay=delay,
        )
        assign(thrusters.problem, gram=product(wrench, wrench.T))
        for row, side in enumerate((1.0, -1.0) if count else ()):
            for i in range(3):
                find_times(thrusters, side * np.eye(6)[i])
                thrusters.peak[row, i] = np.max(thrusters.problem.x)
        return thrusters


@kernel
def find_times(thrusters: AssumedThrusters, impulse: Array) -> None:
    """Write into ``problem.x`` the times, s, that give an ``impulse`` (6,) N m s."""
    problem = thrusters.problem
    for j in range(int(thrusters.count)):
        problem.right[j] = along(thrusters, j, impulse)
    solve(problem, int(thrusters.count))


@kernel
def along(thrusters: AssumedThrusters, j: int, impulse: Array) -> float:
    """Return the product of a thruster's wrench and an ``impulse`` (6,)."""
    total, wrench = 0.0, thrusters.wrench[j]
    for i in range(6):
        total += wrench[i] * impulse[i]
    return total


@kernel
def within_reach(thrusters: AssumedThrusters, demand: Array) -> float:
    """Return the share of a ``demand`` (6,) N m that thrusters open all the time can give.

    Its force is zero.
    """
    peak = 0.0
    for i in range(3):
        peak += abs(demand[i]) * thrusters.peak[0 if demand[i] > 0.0 else 1, i]
    if peak <= 1.0:  # one axis beside the other: there is at least this solution
        return 1.0
    find_times(thrusters, demand)
    peak = 1.0
    for j in range(int(thrusters.count)):
        peak = max(peak, thrusters.problem.x[j])
    return 1.0 / peak


@kernel
def expect_torque(thrusters: AssumedThrusters, tick: int, torque: Array) -> None:
    """Record the valves commanded at ``tick``; write the ``torque`` (3,) N m from then on."""
    for j in range(int(thrusters.count)):
        if thrusters.is_open[j] == 1.0:
            row = thrusters.expected[(tick + int(thrusters.delay[j])) % LONGEST_DELAY]
            for i in range(3):
                row[i] += thrusters.wrench[j, i]
    due = thrusters.expected[tick % LONGEST_DELAY]
    for i in range(3):
        torque[i] = due[i]
        due[i] = 0.0


@kernel
def forget_missed(thrusters: AssumedThrusters, last: int, tick: int) -> None:
    """Clear the unused torque expected between the ``last`` tick and ``tick``.

    What is commanded and comes later stays; of a clock that goes back all is cleared.
    """
    missed = min(tick - last - 1, LONGEST_DELAY) if tick > last else LONGEST_DELAY
    for k in range(missed):
        row = thrusters.expected[(tick - 1 - k) % LONGEST_DELAY]
        for i in range(3):
            row[i] = 0.0
