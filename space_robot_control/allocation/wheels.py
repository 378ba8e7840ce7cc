"""Wheels as the flight software knows them, and the distribution of a torque.

A demand beyond the motors' torques is scaled as a whole: it keeps its direction. A wheel that has
its largest momentum cannot speed up any more: it gives what it can, and the others take the rest
by least squares, so that the axes that it does not turn are as good as before.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.wheels import WheelSettings
from space_robot_msgs_py.compiled.kernels import kernel, subroutine
from space_robot_msgs_py.compiled.records import Record, assign, nested, shaped
from space_robot_msgs_py.samples import MOST_WHEELS

from .least_largest import least_largest
from .settings import AllocationSettings
from .wheel_set import WheelSet, tabulate

Array = NDArray[np.float64]

FULL = 0.99
"""Share of its largest momentum up to which a wheel is sped up."""


class AssumedWheels(Record):
    """Wheels of one base as assumed by the flight software."""

    count: float = shaped(lambda n: ())
    period: float = shaped(lambda n: ())
    """Length of a tick, s."""
    is_least_largest: float = shaped(lambda n: ())
    """0: they share a torque by the pseudo-inverse."""
    axis: Array = shaped(lambda n: (MOST_WHEELS, 3))
    """Unit vectors, base frame."""
    inertia: Array = shaped(lambda n: (MOST_WHEELS,))
    """Inertia of each rotor about its axis, kg m2."""
    max_torque: Array = shaped(lambda n: (MOST_WHEELS,))
    """N m; inf: no limit."""
    max_momentum: Array = shaped(lambda n: (MOST_WHEELS,))
    """N m s; inf: no limit."""
    momentum: Array = shaped(lambda n: (MOST_WHEELS,))
    """Inertia times speed at the present tick, N m s; 0 for a wheel that has failed."""
    healthy: WheelSet = nested(WheelSet)
    """Wheels that have not failed."""
    free: WheelSet = nested(WheelSet)
    """Wheels below their largest momentum, if any wheel has reached it."""
    torque: Array = shaped(lambda n: (MOST_WHEELS,))
    """Torque of the motors commanded at the present tick, N m."""
    wanted: Array = shaped(lambda n: (3,))
    """Scratch: ``A torque`` that is wanted, N m."""
    is_scaled: float = shaped(lambda n: ())
    """1 if the demand of the present tick was beyond the motors' torques, else 0."""
    scaled_ticks: float = shaped(lambda n: ())
    """Ticks so far in which the demand was beyond the motors' torques."""
    full_ticks: float = shaped(lambda n: ())
    """Ticks so far in which a wheel would have been sped up beyond its largest momentum."""

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
        )
        for part in (wheels.healthy, wheels.free):
            part.takes_part[:count] = 1.0
            part.full_load[:] = np.where(np.isfinite(load), load, 1.0)
        if count:
            tabulate(wheels.healthy, wheels.axis, count)
        else:  # without waiting for compiled code
            wheels.healthy.beyond[:] = np.eye(3)
        return wheels


@subroutine
def stored_momentum(wheels: AssumedWheels) -> tuple[float, float, float]:
    """Return the momentum of all wheels relative to the base, N m s, base frame."""
    x, y, z = 0.0, 0.0, 0.0
    for k in range(int(wheels.count)):
        h, axis = wheels.momentum[k], wheels.axis[k]
        x += axis[0] * h
        y += axis[1] * h
        z += axis[2] * h
    return x, y, z


@kernel
def share_torque(wheels: AssumedWheels, demand: Array) -> None:
    """Write the motors' ``torque`` that turns the base with ``demand`` (3,) N m, base frame."""
    count, torque, wanted = int(wheels.count), wheels.torque, wheels.wanted
    for i in range(3):
        wanted[i] = -demand[i]
    if wheels.is_least_largest == 1.0 and wheels.healthy.rank == 3.0:
        least_largest(wheels.healthy, count, wanted, torque)
    else:
        least_squares(wheels.healthy, count, wanted, torque)
    wheels.is_scaled = 1.0 if scale_down(wheels, torque) else 0.0
    if not _is_any_full(wheels):
        wheels.scaled_ticks += wheels.is_scaled
        return
    wheels.full_ticks += 1.0
    free = wheels.free
    for k in range(count):
        free.takes_part[k] = wheels.healthy.takes_part[k]
    while _take_out_full(wheels):
        tabulate(free, wheels.axis, count)
        for i in range(3):
            wanted[i] = -demand[i]
            for k in range(count):
                if free.takes_part[k] == 0.0:
                    wanted[i] -= wheels.axis[k, i] * torque[k]
        for k in range(count):
            if free.takes_part[k] == 1.0:
                row = free.inverse[k]
                torque[k] = row[0] * wanted[0] + row[1] * wanted[1] + row[2] * wanted[2]
        if scale_down(wheels, torque):
            wheels.is_scaled = 1.0
    wheels.scaled_ticks += wheels.is_scaled


@kernel
def least_squares(wheels: WheelSet, count: int, wanted: Array, torque: Array) -> None:
    """Write ``torque = A^+ wanted``."""
    for k in range(count):
        row = wheels.inverse[k]
        torque[k] = row[0] * wanted[0] + row[1] * wanted[1] + row[2] * wanted[2]


@kernel
def scale_down(wheels: AssumedWheels, torque: Array) -> bool:
    """Scale all torques to the motors' limits; return whether a limit was exceeded.

    No torque is above its limit by so much as a rounding, and the largest one is exactly at it.
    """
    excess = 1.0
    for k in range(int(wheels.count)):
        excess = max(excess, abs(torque[k]) / wheels.max_torque[k])
    if excess > 1.0:
        for k in range(int(wheels.count)):
            load = torque[k] / wheels.max_torque[k]
            if load != 0.0:
                torque[k] = load / excess * wheels.max_torque[k]
            else:  # no limit
                torque[k] /= excess
    return excess > 1.0


@kernel
def momentum_room(wheels: AssumedWheels, k: int, side: float) -> float:
    """Return the torque that fills wheel ``k`` up to `FULL` within a tick, N m.

    ``side``: direction of the torque, 1 or -1. The motor's largest torque is not looked at.
    """
    left = (FULL * wheels.max_momentum[k] - side * wheels.momentum[k]) / wheels.period
    room: float = max(left, 0.0)
    return room


@subroutine
def _is_any_full(wheels: AssumedWheels) -> bool:
    for k in range(int(wheels.count)):
        side = 1.0 if wheels.torque[k] > 0.0 else -1.0
        if abs(wheels.torque[k]) > momentum_room(wheels, k, side):
            return True
    return False


@subroutine
def _take_out_full(wheels: AssumedWheels) -> bool:
    """Exclude full wheels from `free` at their torque; return whether there were any."""
    is_any = False
    for k in range(int(wheels.count)):
        side = 1.0 if wheels.torque[k] > 0.0 else -1.0
        left = momentum_room(wheels, k, side)
        if wheels.free.takes_part[k] == 1.0 and abs(wheels.torque[k]) > left:
            wheels.torque[k] = side * left
            wheels.free.takes_part[k] = 0.0
            is_any = True
    return is_any
