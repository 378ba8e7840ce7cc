"""What is asked of each part of a set of actuators: of those that flew, or of others.

Of those that flew their own columns tell. Of others it follows from the demand on the base: wheels
share it by least squares of their loads, thrusters as the least propellant asks.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import product
from space_robot_model.hardware.base_actuators import (
    BaseActuatorSettings,
    ThrusterSettings,
    WheelSettings,
)
from space_robot_msgs_py.bag.flight_log import FlightLog

from ..flight.capability import ThrusterTorques, carried_momentum, wheel_loads
from .actuation import ROUNDING, wheel_motion
from .external_torques import axes_of

Array = NDArray[np.float64]

TINY = 1e-300
"""Keeps a thruster that turns nothing from being divided by zero."""
AT_LIMIT = 1e-3
"""Share of a limit within which a number is at it: a law that learns of the torque given settles
at a limit little by little."""


class Demand(NamedTuple):
    """Demand on the base in the base frame, one row per tick."""

    torque: Array
    """(N, 3) N m asked over the interval that ended at the tick: commanded, or given where no
    command is known."""
    momentum: Array
    """(N, 3) N m s that wheels hold at the tick beyond those of the flight's first one."""
    omega: Array
    """(N, 3) rad/s of the base."""


class LoadRequirement(NamedTuple):
    """A number that is asked of a part of the base's actuators, and what the part has."""

    part: str
    """An axis of the base, a wheel, or the thrusters."""
    quantity: str
    unit: str
    asked: float
    has: float
    """Infinite where there is no limit."""

    @property
    def is_met(self) -> bool:
        """True if the part has what is asked; at its limit it lacks it."""
        return self.asked == 0.0 or self.asked < self.has * (1.0 - AT_LIMIT)

    @property
    def is_at_limit(self) -> bool:
        """True if what is asked is all that the part has."""
        return 0.0 < self.has < np.inf and abs(self.asked / self.has - 1.0) <= AT_LIMIT

    @property
    def margin(self) -> float | None:
        """Share of what the part has that is not asked; None: it has no limit, or nothing."""
        if not np.isfinite(self.has) or self.has == 0.0:
            return None
        return 1.0 - self.asked / self.has

    def as_data(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            **self._asdict(),
            "has": self.has if np.isfinite(self.has) else None,
            "margin": self.margin,
            "is_met": self.is_met,
            "is_at_limit": self.is_at_limit,
        }


class Load(ABC):
    """What is asked of some actuators, summed up block by block."""

    @abstractmethod
    def add(self, start: int, stop: int, demand: Demand) -> None:
        """Take further rows, and the demand in them."""

    @abstractmethod
    def requirements(self, period: float) -> list[LoadRequirement]:
        """Return what all rows so far asked for; ticks are ``period`` s apart."""


def loads_on(actuators: BaseActuatorSettings, log: FlightLog, is_flown: bool) -> list[Load]:
    """Return the loads on a set of actuators; ``is_flown``: it is the one that flew."""
    loads: list[Load] = []
    if actuators.wheels.count:
        loads.append((WheelLoad if is_flown else OtherWheelLoad)(actuators.wheels, log))
    if actuators.thrusters.count:
        kind = ThrusterLoad if is_flown else OtherThrusterLoad
        loads.append(kind(actuators.thrusters, log, are_alone=not actuators.wheels.count))
    return loads


class WheelLoad(Load):
    """Largest motor torque and momentum of each wheel."""

    def __init__(self, wheels: WheelSettings, log: FlightLog) -> None:
        self._wheels, self._log = wheels, log
        self._largest = np.zeros((2, wheels.count))
        """Torque, N m, and momentum, N m s."""

    def add(self, start: int, stop: int, demand: Demand) -> None:
        """Take further rows."""
        here = [np.abs(values).max(axis=0) for values in self._series(start, stop, demand)]
        self._largest = np.maximum(self._largest, here)

    def requirements(self, period: float) -> list[LoadRequirement]:
        """Return both of every wheel."""
        kinds = (("peak torque", "N m", "torque"), ("largest momentum", "N m s", "momentum"))
        limits = [self._wheels.limits(f"max_{key}") for _, _, key in kinds]
        return [
            LoadRequirement(
                f"wheel_{i + 1}", kind, unit, float(self._largest[k, i]), float(limits[k][i])
            )
            for i in range(self._wheels.count)
            for k, (kind, unit, _) in enumerate(kinds)
        ]

    def _series(self, start: int, stop: int, demand: Demand) -> tuple[Array, Array]:
        """Return what the motors give and where they bring the wheels."""
        return wheel_motion(self._log, start, stop, self._wheels)


class OtherWheelLoad(WheelLoad):
    """The same of wheels that did not fly, see `wheel_loads`."""

    def _series(self, start: int, stop: int, demand: Demand) -> tuple[Array, Array]:
        axes, at_first = axes_of(self._log.rows(start, stop)), axes_of(self._log.rows(0, 1))
        momentum = demand.momentum + carried_momentum(self._wheels, at_first, axes)
        torque, held = wheel_loads(self._wheels, demand.torque, momentum, demand.omega)
        return torque, held


class ThrusterLoad(Load):
    """Pulses, propellant, and the largest share of the torque that thrusters can give."""

    def __init__(self, thrusters: ThrusterSettings, log: FlightLog, are_alone: bool) -> None:
        """``are_alone``: there are no wheels, so that the base's whole torque is theirs."""
        self._thrusters, self._log = thrusters, log
        self._torques = ThrusterTorques.of(thrusters) if are_alone else None
        self._share = 0.0
        self._rate = 0.0
        """kg/s, summed up over the ticks."""
        self._rate_of_axes: Array | None = np.zeros(3)
        """The same by axis; None: not known."""
        torques = np.abs(thrusters.torques)
        self._main = np.argmax(torques >= (1.0 - ROUNDING) * torques.max(axis=1)[:, None], axis=1)
        """(T,) the axis that each thruster turns the base about most."""
        self._parts = torques / np.maximum(torques.sum(axis=1, keepdims=True), TINY)
        self._pulses = np.zeros(3, dtype=np.intp)

    def add(self, start: int, stop: int, demand: Demand) -> None:
        """Take further rows."""
        if self._torques:
            self._share = max(self._share, float(np.max(self._torques.share(demand.torque))))
        self._use(start, stop, demand)

    def requirements(self, period: float) -> list[LoadRequirement]:
        """Return what is asked of all together."""
        requirements = []
        if self._torques:
            requirements.append(
                LoadRequirement("thrusters", "share of their torque", "-", self._share, 1.0)
            )
        if self._rate_of_axes is not None:
            tank = self._thrusters.propellant or np.inf
            mass = period * self._rate
            requirements.append(LoadRequirement("thrusters", "propellant", "kg", mass, tank))
        return requirements

    def pulses(self) -> NDArray[np.intp] | None:
        """(3,) of each axis: a pulse counts for the one that it turns the base about most."""
        return self._pulses

    def propellant(self, period: float) -> Array | None:
        """(3,) kg of each axis: that of a thruster goes to all, as its torque does."""
        return None if self._rate_of_axes is None else period * self._rate_of_axes

    def _use(self, start: int, stop: int, demand: Demand) -> None:
        thrusts = self._log.thrusts[start:stop]
        is_open = self._log.thrusts[max(start - 1, 0) : stop] > 0.0
        if start == 0:
            is_open = np.concatenate([np.zeros((1, is_open.shape[1]), dtype=bool), is_open])
        begun = is_open[1:] & ~is_open[:-1]
        self._pulses += np.bincount(self._main, np.sum(begun, axis=0), minlength=3).astype(np.intp)
        shares = np.sum(thrusts, axis=0) / self._thrusters.values("force")
        rate = shares * self._thrusters.mass_flow
        self._rate += float(np.sum(rate))
        if self._rate_of_axes is not None:
            self._rate_of_axes += product(rate, self._parts)


class OtherThrusterLoad(ThrusterLoad):
    """The same of thrusters that did not fly: the least propellant, as if they were not on or off.

    Beside wheels nothing is known of them: it is the allocation that shares the work out.
    """

    def __init__(self, thrusters: ThrusterSettings, log: FlightLog, are_alone: bool) -> None:
        super().__init__(thrusters, log, are_alone)
        if not are_alone:
            self._rate_of_axes = None

    def pulses(self) -> None:
        """Return None: it is the allocation that makes pulses of a torque."""

    def _use(self, start: int, stop: int, demand: Demand) -> None:
        if not self._torques or self._rate_of_axes is None:
            return
        self._rate += float(np.sum(self._torques.propellant(demand.torque)))
        for i in range(3):
            alone = np.zeros_like(demand.torque)
            alone[:, i] = demand.torque[:, i]
            self._rate_of_axes[i] += float(np.sum(self._torques.propellant(alone)))
