"""What is asked of each part of a set of actuators: of those that flew, or of others.

Of those that flew their own columns tell. Of others it follows from the demand on the base: wheels
share it by least squares of their loads, thrusters as the least propellant asks.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import product
from space_robot_model.hardware.base_actuators import ThrusterSettings, WheelSettings
from space_robot_msgs_py.bag.flight_log import FlightLog

from ..flight.capability import ThrusterTorques, carried_momentum, wheel_loads
from .base_demand import Demand, axes_of
from .wheel_saturation import ROUNDING, WheelMotion, WheelRows

Array = NDArray[np.float64]

TINY = 1e-300
"""Keeps a thruster that turns nothing from being divided by zero."""


AT_LIMIT = 1e-3
"""Share of a limit within which a number is at it: a law that learns of the torque given settles
at a limit little by little."""


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


class Load(ABC):
    """What is asked of some actuators, summed up block by block."""

    @abstractmethod
    def add(self, log: FlightLog, demand: Demand) -> None:
        """Take further rows."""

    @abstractmethod
    def requirements(self, period: float) -> list[LoadRequirement]:
        """Return what all rows so far asked for; ticks are ``period`` s apart."""


class WheelLoad(Load):
    """Largest motor torque and momentum of each wheel."""

    def __init__(self, wheels: WheelSettings) -> None:
        self._wheels = wheels
        self._motion = WheelMotion(wheels)
        self._torque = np.zeros(wheels.count)
        self._momentum = np.zeros(wheels.count)

    def add(self, log: FlightLog, demand: Demand) -> None:
        """Take further rows."""
        torque, momentum = self._series(log, demand)
        self._torque = np.maximum(self._torque, np.max(np.abs(torque), axis=0))
        self._momentum = np.maximum(self._momentum, np.max(np.abs(momentum), axis=0))

    def requirements(self, period: float) -> list[LoadRequirement]:
        """Return both of every wheel."""
        limits = [self._wheels.limits(f"max_{key}") for key in ("torque", "momentum")]
        requirements = []
        for i in range(self._wheels.count):
            name = f"wheel_{i + 1}"
            torque, momentum = float(self._torque[i]), float(self._momentum[i])
            requirements += [
                LoadRequirement(name, "peak torque", "N m", torque, float(limits[0][i])),
                LoadRequirement(name, "largest momentum", "N m s", momentum, float(limits[1][i])),
            ]
        return requirements

    def _series(self, log: FlightLog, demand: Demand) -> WheelRows:
        """Return what the motors give and where they bring the wheels."""
        return self._motion.add(log)


class OtherWheelLoad(WheelLoad):
    """The same of wheels that did not fly, see `wheel_loads`."""

    _start: Array | None = None
    """(3, 3, 1) the base's axes at the first row."""

    def _series(self, log: FlightLog, demand: Demand) -> WheelRows:
        axes = axes_of(log)
        self._start = axes[:, :, :1] if self._start is None else self._start
        momentum = demand.momentum + carried_momentum(self._wheels, self._start, axes)
        return WheelRows(*wheel_loads(self._wheels, demand.torque, momentum, demand.omega))


class ThrusterLoad(Load):
    """Pulses, propellant, and the largest share of the torque that thrusters can give."""

    def __init__(self, thrusters: ThrusterSettings, are_alone: bool) -> None:
        """``are_alone``: there are no wheels, so that the base's whole torque is theirs."""
        self._thrusters = thrusters
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
        self._open: NDArray[np.bool_] = np.zeros((1, thrusters.count), dtype=bool)
        self._pulses = np.zeros(3, dtype=np.intp)

    def add(self, log: FlightLog, demand: Demand) -> None:
        """Take further rows."""
        if self._torques:
            self._share = max(self._share, float(np.max(self._torques.share(demand.torque))))
        self._use(log, demand)

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

    def _use(self, log: FlightLog, demand: Demand) -> None:
        is_open = log.thrusts > 0.0
        begun = np.diff(is_open, axis=0, prepend=self._open) & is_open
        self._open = is_open[-1:].copy()
        self._pulses += np.bincount(self._main, np.sum(begun, axis=0), minlength=3).astype(np.intp)
        shares = np.sum(log.thrusts, axis=0) / self._thrusters.values("force")
        rate = shares * self._thrusters.mass_flow
        self._rate += float(np.sum(rate))
        if self._rate_of_axes is not None:
            self._rate_of_axes += product(rate, self._parts)


class OtherThrusterLoad(ThrusterLoad):
    """The same of thrusters that did not fly: the least propellant, as if they were not on or off.

    Beside wheels nothing is known of them: it is the allocation that shares the work out.
    """

    def __init__(self, thrusters: ThrusterSettings, are_alone: bool) -> None:
        super().__init__(thrusters, are_alone)
        if not are_alone:
            self._rate_of_axes = None

    def pulses(self) -> None:
        """Return None: it is the allocation that makes pulses of a torque."""

    def _use(self, log: FlightLog, demand: Demand) -> None:
        if not self._torques or self._rate_of_axes is None:
            return
        self._rate += float(np.sum(self._torques.propellant(demand.torque)))
        for i in range(3):
            alone = np.zeros_like(demand.torque)
            alone[:, i] = demand.torque[:, i]
            self._rate_of_axes[i] += float(np.sum(self._torques.propellant(alone)))
