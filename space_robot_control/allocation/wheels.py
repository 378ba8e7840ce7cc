"""Wheels as the flight software knows them: sharing of a torque, null motion, failed wheels.

A demand beyond the motors' torques is scaled as a whole: it keeps its direction. A wheel that has
its largest momentum cannot speed up any more: it gives what it can, and the others take the rest
by least squares, so that axes that it does not turn lose nothing.

**Null motion.** The wheels' momenta h fall into ``A^+ A h``, which is what they store for the base,
and z in the null space of A. The null motion takes z to ``c n``, n the null vector of `WheelSet`,
and all other parts of z to zero, which balances the wheels:

    u = gain (c n - z)

scaled as a whole to a share of the motors' torques, and to what the demand leaves of them: nothing
in a tick in which it was scaled down itself. It is linear, so it does not chatter. c keeps each
wheel's speed beyond a least one, as far as that can be had, and its momentum within `FULL`: it
stays as it is until a wheel is about to come too near to zero, then goes on to the nearest value
that will do; a wheel that must cross zero does so at once.

**Failed wheels** are those whose motor does not give the commanded torque for long enough.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.algebra import Vector, add, dot, scale, subtract, vector
from space_robot_model.hardware.base_actuators import WheelSettings
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, assign, nested, shaped
from space_robot_msgs_py.samples import MOST_WHEELS

from .settings import AllocationSettings
from .wheel_set import LEAST_PART, WheelSet, least_largest, tabulate

Array = NDArray[np.float64]

FULL = 0.99
"""Share of its largest momentum up to which a wheel is sped up."""
BEYOND = 1.1
"""Margin of a new c over the least speed, so that it is not changed again at once."""
BETTER = 0.8
"""Improvement required to change c where no value satisfies the limits."""
FULL_COUNTS = 10.0
"""Weight of a wheel beyond its largest momentum, in wheels that stand still."""
LEAST_ASKED = 1e-3
"""Share of full load below which commands are not evaluated."""
LEAST_GIVEN = 0.2
"""Share of the commanded torque below which a wheel counts as silent."""


class AssumedWheels(Record):
    """Wheels of one base as assumed by the flight software."""

    count: float = shaped(lambda n: ())
    period: float = shaped(lambda n: (), "Length of a tick, s")
    is_least_largest: float = shaped(lambda n: (), "0: they share a torque by the pseudo-inverse")
    axis: Array = shaped(lambda n: (MOST_WHEELS, 3), "Unit vectors, base frame")
    inertia: Array = shaped(lambda n: (MOST_WHEELS,), "Inertia of each rotor about its axis, kg m2")
    max_torque: Array = shaped(lambda n: (MOST_WHEELS,), "N m; inf: no limit")
    max_momentum: Array = shaped(lambda n: (MOST_WHEELS,), "N m s; inf: no limit")
    momentum: Array = shaped(lambda n: (MOST_WHEELS,))
    """Inertia times speed at the present tick, N m s; 0 for a wheel that has failed."""
    healthy: WheelSet = nested(WheelSet)
    """Wheels that have not failed."""
    free: WheelSet = nested(WheelSet)
    """Wheels below their largest momentum, if any wheel has reached it."""
    torque: Array = shaped(lambda n: (MOST_WHEELS,))
    """Torque of the motors commanded at the present tick, N m."""
    is_scaled: float = shaped(lambda n: ())
    """1 if the demand of the present tick was beyond the motors' torques, else 0."""
    scaled_ticks: float = shaped(lambda n: ())
    """Ticks so far in which the demand was beyond the motors' torques."""
    full_ticks: float = shaped(lambda n: ())
    """Ticks so far in which a wheel would have been sped up beyond its largest momentum."""
    null_gain: float = shaped(lambda n: (), "1/s; 0: there is no null motion")
    null_share: float = shaped(lambda n: ())
    """Share of a motor's largest torque available to the null motion."""
    least_speed: float = shaped(lambda n: (), "rad/s")
    c: float = shaped(lambda n: (), "N m s")
    stored: Array = shaped(lambda n: (MOST_WHEELS,), "``A^+ A h``, N m s")
    null_torque: Array = shaped(lambda n: (MOST_WHEELS,), "u of the null motion, N m")
    failure_ticks: float = shaped(lambda n: ())
    """Ticks of silence in a row until a wheel has failed; 0: never."""
    asked_at: float = shaped(lambda n: (), "Tick of the command `asked`; -1: never")
    asked: Array = shaped(lambda n: (MOST_WHEELS,), "Motors' torques at that tick, N m")
    silent_ticks: Array = shaped(lambda n: (MOST_WHEELS,))
    """Consecutive silent ticks, of the ticks with a sufficient command."""

    @classmethod
    def build(
        cls, n: int, assumed: WheelSettings, settings: AllocationSettings, period: float
    ) -> AssumedWheels:
        """Read the numbers of the settings; ``period`` of a tick in s."""
        wheels, count = cls.allocate(n), assumed.count
        torque, momentum = np.full((2, MOST_WHEELS), np.inf)
        torque[:count] = assumed.limits("max_torque")
        momentum[:count] = assumed.limits("max_momentum")
        load = torque if np.all(np.isfinite(torque[:count])) else np.ones(MOST_WHEELS)
        axis, inertia = np.zeros((MOST_WHEELS, 3)), np.ones(MOST_WHEELS)
        axis[:count], inertia[:count] = assumed.unit_axes, assumed.values("rotor_inertia")
        assign(
            wheels,
            count=count,
            period=period,
            axis=axis,
            inertia=inertia,
            max_torque=torque,
            max_momentum=momentum,
            is_least_largest=settings.wheels == "least_largest",
            null_gain=settings.null_gain,
            null_share=settings.null_share,
            least_speed=settings.least_speed,
            failure_ticks=settings.failure_ticks,
            asked_at=-1.0,
        )
        for part in (wheels.healthy, wheels.free):
            part.takes_part[:count] = 1.0
            part.full_load[:] = np.where(np.isfinite(load), load, 1.0)
        if count:
            tabulate(wheels.healthy, wheels.axis, count)
        else:  # without waiting for compiled code
            wheels.healthy.beyond[:] = np.eye(3)
        return wheels


@kernel
def command_wheels(wheels: AssumedWheels, tick: float, demand: Vector) -> None:
    """Write the motors' ``torque`` that turns the base with ``demand``, N m, base frame."""
    _share_torque(wheels, demand)
    _add_null_motion(wheels)
    wheels.asked_at = tick
    for k in range(int(wheels.count)):
        wheels.asked[k] = wheels.torque[k]


@subroutine
def stored_momentum(wheels: AssumedWheels) -> Vector:
    """Return the momentum of all wheels relative to the base, N m s, base frame.

    That of a wheel that has failed is not known, and zero.
    """
    total = (0.0, 0.0, 0.0)
    for k in range(int(wheels.count)):
        total = add(total, scale(vector(wheels.axis[k], 0), wheels.momentum[k]))
    return total


@subroutine
def _share_torque(wheels: AssumedWheels, demand: Vector) -> None:
    count, torque = int(wheels.count), wheels.torque
    wanted = (-demand[0], -demand[1], -demand[2])  # motors push back on the base
    if wheels.is_least_largest == 1.0 and wheels.healthy.rank == 3.0:
        least_largest(wheels.healthy, count, wanted, torque)
    else:
        for k in range(count):
            torque[k] = dot(vector(wheels.healthy.inverse[k], 0), wanted)
    wheels.is_scaled = 1.0 if scale_down(wheels, torque) else 0.0
    free = wheels.free
    for k in range(count):
        free.takes_part[k] = wheels.healthy.takes_part[k]
    is_full = _take_out_full(wheels)
    wheels.full_ticks += 1.0 if is_full else 0.0
    # ends: each round takes at least one wheel out
    while is_full:
        tabulate(free, wheels.axis, count)
        left = wanted
        for k in range(count):
            if free.takes_part[k] == 0.0:
                left = subtract(left, scale(vector(wheels.axis[k], 0), torque[k]))
        for k in range(count):
            if free.takes_part[k] == 1.0:
                torque[k] = dot(vector(free.inverse[k], 0), left)
        if scale_down(wheels, torque):
            wheels.is_scaled = 1.0
        is_full = _take_out_full(wheels)
    wheels.scaled_ticks += wheels.is_scaled


@kernel
def scale_down(wheels: AssumedWheels, torque: Array) -> bool:
    """Scale all torques to the motors' limits; return whether a limit was exceeded."""
    excess = 1.0
    for k in range(int(wheels.count)):
        excess = max(excess, abs(torque[k]) / wheels.max_torque[k])
    if excess > 1.0:
        for k in range(int(wheels.count)):
            # in this order of operations the largest torque is its limit to the last bit
            load = torque[k] / wheels.max_torque[k]
            if load != 0.0:
                torque[k] = load / excess * wheels.max_torque[k]
            else:  # no limit
                torque[k] /= excess
    return excess > 1.0


@subroutine
def _momentum_room(wheels: AssumedWheels, k: int, side: float) -> float:
    """Return the torque that fills wheel ``k`` up to `FULL` within a tick, N m.

    ``side``: direction of the torque, 1 or -1. The motor's largest torque is left out of account.
    """
    left = (FULL * wheels.max_momentum[k] - side * wheels.momentum[k]) / wheels.period
    room: float = max(left, 0.0)
    return room


@subroutine
def _take_out_full(wheels: AssumedWheels) -> bool:
    """Exclude full wheels from `free` at their torque; return whether there were any."""
    is_any = False
    for k in range(int(wheels.count)):
        side = 1.0 if wheels.torque[k] > 0.0 else -1.0
        left = _momentum_room(wheels, k, side)
        if wheels.free.takes_part[k] == 1.0 and abs(wheels.torque[k]) > left:
            wheels.torque[k] = side * left
            wheels.free.takes_part[k] = 0.0
            is_any = True
    return is_any


@subroutine
def _add_null_motion(wheels: AssumedWheels) -> None:
    count, healthy = int(wheels.count), wheels.healthy
    members = 0.0
    for k in range(count):
        members += healthy.takes_part[k]
    if wheels.null_gain == 0.0 or members <= healthy.rank or wheels.is_scaled == 1.0:
        return
    total = stored_momentum(wheels)
    for k in range(count):
        wheels.stored[k] = dot(vector(healthy.inverse[k], 0), total)
    _choose_c(wheels)
    share = 1.0
    for k in range(count):
        held = wheels.momentum[k] - wheels.stored[k]
        torque = wheels.null_gain * (wheels.c * healthy.null[k] - held)
        if healthy.takes_part[k] == 0.0:
            torque = 0.0
        wheels.null_torque[k] = torque
        if torque == 0.0:
            continue
        side = 1.0 if torque > 0.0 else -1.0
        most = min(wheels.max_torque[k], _momentum_room(wheels, k, side))
        left = max(most - side * wheels.torque[k], 0.0)
        share = min(share, min(wheels.null_share * wheels.max_torque[k], left) / abs(torque))
    for k in range(count):
        wheels.torque[k] += share * wheels.null_torque[k]


@subroutine
def _choose_c(wheels: AssumedWheels) -> None:
    """Change c if a wheel is too near to zero speed or beyond its largest momentum."""
    if wheels.least_speed == 0.0:
        return
    present = _null_cost(wheels, wheels.c)
    if present == 0.0:
        return
    best, least = wheels.c, BETTER * present
    for k in range(int(wheels.count)):
        part = wheels.healthy.null[k]
        if abs(part) < LEAST_PART:
            continue
        for side in (1.0, -1.0):
            edge = side * BEYOND * wheels.least_speed * wheels.inertia[k]
            c = (edge - wheels.stored[k]) / part
            cost = _null_cost(wheels, c)
            is_nearer = abs(c - wheels.c) < abs(best - wheels.c)
            if cost < least or (cost == least and is_nearer and best != wheels.c):
                best, least = c, cost
    wheels.c = best


@kernel
def _null_cost(wheels: AssumedWheels, c: float) -> float:
    """Return by how much wheels lack the least speed, or exceed `FULL`, under ``c``; relative."""
    total = 0.0
    for k in range(int(wheels.count)):
        part = wheels.healthy.null[k]
        if abs(part) < LEAST_PART:
            continue
        momentum = abs(wheels.stored[k] + c * part)
        least = wheels.least_speed * wheels.inertia[k]
        total += max(0.0, 1.0 - momentum / least)
        total += FULL_COUNTS * max(0.0, momentum / wheels.max_momentum[k] - FULL)
    return total


@kernel
def observe_wheels(wheels: AssumedWheels, tick: float, speeds: Array, torques: Array) -> None:
    """Evaluate the wheels' speeds and torques at ``tick``; exclude failed wheels."""
    count, healthy = int(wheels.count), wheels.healthy
    for k in range(count):
        wheels.momentum[k] = wheels.inertia[k] * speeds[k] * healthy.takes_part[k]
    if wheels.failure_ticks == 0.0 or tick != wheels.asked_at + 1.0:
        return
    heard, silent = 0.0, 0.0
    for k in range(count):
        if _is_asked(wheels, k):
            # by size alone: with a sign, late commands would make any wheel look wrong
            is_silent = abs(torques[k]) < LEAST_GIVEN * abs(wheels.asked[k])
            silent += 1.0 if is_silent else 0.0
            heard += 0.0 if is_silent else 1.0
    # where several are asked and none answers, it is the commands that do not arrive
    if heard == 0.0 and silent > 1.0:
        return
    has_failed = False
    for k in range(count):
        if _is_asked(wheels, k):
            is_silent = abs(torques[k]) < LEAST_GIVEN * abs(wheels.asked[k])
            wheels.silent_ticks[k] = wheels.silent_ticks[k] + 1.0 if is_silent else 0.0
            if wheels.silent_ticks[k] >= wheels.failure_ticks:
                healthy.takes_part[k] = 0.0
                wheels.momentum[k] = 0.0
                has_failed = True
    if has_failed:
        tabulate(healthy, wheels.axis, count)


@subroutine
def _is_asked(wheels: AssumedWheels, k: int) -> bool:
    """Return True if a healthy wheel below its largest momentum was commanded a torque."""
    is_commanded = abs(wheels.asked[k]) > LEAST_ASKED * wheels.healthy.full_load[k]
    is_below = abs(wheels.momentum[k]) < (2.0 * FULL - 1.0) * wheels.max_momentum[k]
    return bool(wheels.healthy.takes_part[k] == 1.0 and is_commanded and is_below)
