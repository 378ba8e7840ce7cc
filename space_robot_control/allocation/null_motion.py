"""Null motion: wheel momenta that cancel one another without effect on the base.

The wheels' momenta h fall into ``A^+ A h``, which is what they store for the base, and z in the
null space of A. The null motion takes z to ``c n``, n the null vector of `WheelSet`, and all other
parts of z to zero, which balances the wheels:

    u = gain (c n - z)

scaled as a whole to a share of the motors' torques, and to what the demand leaves of them: nothing
in a tick in which it was scaled down itself.

It is linear, so it does not chatter. c keeps each wheel's speed beyond a least one, as far as that
can be had, and its momentum within `FULL`: it stays as it is until a wheel is about to come too
near to zero, then goes on to the nearest value that will do; a wheel that must cross zero does so
at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, assign, shaped
from space_robot_msgs_py.samples import MOST_WHEELS

from .settings import AllocationSettings
from .wheel_set import LEAST_PART
from .wheels import FULL, AssumedWheels, momentum_room

Array = NDArray[np.float64]

BEYOND = 1.1
"""Margin of a new c over the least speed, so that it is not changed again at once."""
BETTER = 0.8
"""Improvement required to change c where no value satisfies the limits."""
FULL_COUNTS = 10.0
"""Weight of a wheel beyond its largest momentum, in wheels that stand still."""


class NullMotion(Record):
    """Settings and memory of the null motion."""

    gain: float = shaped(lambda n: ())
    """1/s; 0: there is none."""
    share: float = shaped(lambda n: ())
    """Share of a motor's largest torque available to the null motion."""
    least_speed: float = shaped(lambda n: ())
    """rad/s."""
    c: float = shaped(lambda n: ())
    """N m s."""
    stored: Array = shaped(lambda n: (MOST_WHEELS,))
    """``A^+ A h``, N m s."""
    torque: Array = shaped(lambda n: (MOST_WHEELS,))
    """u, N m."""

    @classmethod
    def build(cls, n: int, settings: AllocationSettings) -> NullMotion:
        """Read the settings."""
        motion = cls.allocate(n)
        assign(
            motion,
            gain=settings.null_gain,
            share=settings.null_share,
            least_speed=settings.least_speed,
        )
        return motion


@kernel
def add_null_motion(motion: NullMotion, wheels: AssumedWheels) -> None:
    """Add the null motion to the motors' torques of the present tick."""
    count, healthy = int(wheels.count), wheels.healthy
    members = 0.0
    for k in range(count):
        members += healthy.takes_part[k]
    if motion.gain == 0.0 or members <= healthy.rank or wheels.is_scaled == 1.0:
        return
    _find_stored(motion, wheels)
    _choose(motion, wheels)
    scale = 1.0
    for k in range(count):
        held = wheels.momentum[k] - motion.stored[k]
        torque = motion.gain * (motion.c * healthy.null[k] - held)
        if healthy.takes_part[k] == 0.0:
            torque = 0.0
        motion.torque[k] = torque
        if torque == 0.0:
            continue
        side = 1.0 if torque > 0.0 else -1.0
        most = min(wheels.max_torque[k], momentum_room(wheels, k, side))
        left = max(most - side * wheels.torque[k], 0.0)
        scale = min(scale, min(motion.share * wheels.max_torque[k], left) / abs(torque))
    for k in range(count):
        wheels.torque[k] += scale * motion.torque[k]


@subroutine
def _find_stored(motion: NullMotion, wheels: AssumedWheels) -> None:
    x, y, z = 0.0, 0.0, 0.0
    for k in range(int(wheels.count)):
        h, axis = wheels.momentum[k] * wheels.healthy.takes_part[k], wheels.axis[k]
        x += axis[0] * h
        y += axis[1] * h
        z += axis[2] * h
    for k in range(int(wheels.count)):
        row = wheels.healthy.inverse[k]
        motion.stored[k] = row[0] * x + row[1] * y + row[2] * z


@subroutine
def _choose(motion: NullMotion, wheels: AssumedWheels) -> None:
    """Change c if a wheel is too near to zero speed or beyond its largest momentum."""
    if motion.least_speed == 0.0:
        return
    present = badness(motion, wheels, motion.c)
    if present == 0.0:
        return
    best, least = motion.c, BETTER * present
    for k in range(int(wheels.count)):
        part = wheels.healthy.null[k]
        if abs(part) < LEAST_PART:
            continue
        for side in (1.0, -1.0):
            edge = side * BEYOND * motion.least_speed * wheels.inertia[k]
            c = (edge - motion.stored[k]) / part
            cost = badness(motion, wheels, c)
            is_nearer = abs(c - motion.c) < abs(best - motion.c)
            if cost < least or (cost == least and is_nearer and best != motion.c):
                best, least = c, cost
    motion.c = best


@kernel
def badness(motion: NullMotion, wheels: AssumedWheels, c: float) -> float:
    """Return by how much wheels lack the least speed, or exceed `FULL`, under ``c``; relative."""
    total = 0.0
    for k in range(int(wheels.count)):
        part = wheels.healthy.null[k]
        if abs(part) < LEAST_PART:
            continue
        momentum = abs(motion.stored[k] + c * part)
        least = motion.least_speed * wheels.inertia[k]
        total += max(0.0, 1.0 - momentum / least)
        total += FULL_COUNTS * max(0.0, momentum / wheels.max_momentum[k] - FULL)
    return total
