"""Detection of failed wheels by comparing reported and commanded torque."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, assign, shaped
from space_robot_msgs_py.samples import MOST_WHEELS

from .settings import AllocationSettings
from .wheel_set import tabulate
from .wheels import FULL, AssumedWheels

Array = NDArray[np.float64]

LEAST_ASKED = 1e-3
"""Share of full load below which commands are not evaluated."""
LEAST_GIVEN = 0.2
"""Share of the commanded torque below which a wheel counts as silent."""


class WheelHealth(Record):
    """State of the failure detection of each wheel."""

    failure_ticks: float = shaped(lambda n: ())
    """Ticks of silence in a row until a wheel has failed; 0: never."""
    tick: float = shaped(lambda n: ())
    """Tick of the command `asked`; -1: never."""
    asked: Array = shaped(lambda n: (MOST_WHEELS,))
    """Motors' torques at that tick, N m."""
    silent_ticks: Array = shaped(lambda n: (MOST_WHEELS,))
    """Consecutive silent ticks, of the ticks with a sufficient command."""

    @classmethod
    def build(cls, n: int, settings: AllocationSettings) -> WheelHealth:
        """Read the settings."""
        health = cls.allocate(n)
        assign(health, failure_ticks=settings.failure_ticks, tick=-1.0)
        return health


@kernel
def observe_wheels(
    health: WheelHealth, wheels: AssumedWheels, tick: float, speeds: Array, torques: Array
) -> None:
    """Evaluate the wheels' speeds and torques at ``tick``; exclude failed wheels.

    A wheel counts as silent by size alone: with a sign, commands that are some ticks late would
    make any wheel look wrong. Where several wheels are asked and none answers, it is the commands
    that do not arrive, and no wheel is blamed.
    """
    count, healthy = int(wheels.count), wheels.healthy
    for k in range(count):
        wheels.momentum[k] = wheels.inertia[k] * speeds[k] * healthy.takes_part[k]
    if health.failure_ticks == 0.0 or tick != health.tick + 1.0:
        return
    heard, silent = 0.0, 0.0
    for k in range(count):
        if _is_asked(health, wheels, k):
            is_silent = abs(torques[k]) < LEAST_GIVEN * abs(health.asked[k])
            silent += 1.0 if is_silent else 0.0
            heard += 0.0 if is_silent else 1.0
    if heard == 0.0 and silent > 1.0:
        return
    is_any = False
    for k in range(count):
        if not _is_asked(health, wheels, k):
            continue
        if abs(torques[k]) >= LEAST_GIVEN * abs(health.asked[k]):
            health.silent_ticks[k] = 0.0
            continue
        health.silent_ticks[k] += 1.0
        if health.silent_ticks[k] >= health.failure_ticks:
            healthy.takes_part[k] = 0.0
            wheels.momentum[k] = 0.0
            is_any = True
    if is_any:
        tabulate(healthy, wheels.axis, count)


@subroutine
def _is_asked(health: WheelHealth, wheels: AssumedWheels, k: int) -> bool:
    """Return True if a healthy wheel below its largest momentum was commanded a torque."""
    return bool(
        wheels.healthy.takes_part[k] == 1.0
        and abs(health.asked[k]) > LEAST_ASKED * wheels.healthy.full_load[k]
        and abs(wheels.momentum[k]) < (2.0 * FULL - 1.0) * wheels.max_momentum[k]
    )


@kernel
def remember_asked(health: WheelHealth, wheels: AssumedWheels, tick: float) -> None:
    """Store the command of ``tick``."""
    health.tick = tick
    for k in range(int(wheels.count)):
        health.asked[k] = wheels.torque[k]
