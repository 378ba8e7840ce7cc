"""Sizing: what a flight asks of its base, and whether a set of actuators has it.

Wheels that turn the base by a torque ``tau`` take up what they give: their momentum on inertial
axes falls by ``integral R tau dt`` whatever does the turning in this flight. So an ideal torque
tells what wheels would hold.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import product
from space_robot_model.hardware.base_actuators import (
    BaseActuatorSettings,
    ThrusterSettings,
    WheelSettings,
)
from space_robot_model.robot.placements import to_base, to_inertial
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES

from ..flight.capability import (
    ThrusterTorques,
    carried_momentum,
    largest_momentum,
    largest_torque,
    wheel_loads,
)
from .actuation import ROUNDING, wheel_motion
from .analysed_log import AnalysedLog
from .external_torques import axes_of
from .series import Definition, metrics

Array = NDArray[np.float64]


class ActuatorSet(NamedTuple):
    """Actuators that a flight may have had, or might have."""

    name: str
    """Of a file of config/actuators, or its path."""
    settings: BaseActuatorSettings


@metrics(
    "sizing",
    {
        "sizing.{base_part}.peak_torque": Definition(
            "N m",
            "largest torque commanded about an axis of the base, or of a wheel's motor",
            is_shown=False,
        ),
        "sizing.{base_part}.peak_momentum": Definition(
            "N m s",
            "largest momentum that wheels have to hold about an axis, or a wheel holds",
            is_shown=False,
        ),
        "sizing.{base_axis}.rms_torque": Definition(
            "N m", "RMS of the torque commanded", is_shown=False
        ),
        "sizing.{base_axis}.angular_impulse": Definition(
            "N m s", "integral of the size of the torque commanded", is_shown=False
        ),
        "sizing.{base_axis}.pulses": Definition(
            "", "pulses of the thrusters that turn the base about this axis most", is_shown=False
        ),
        "sizing.{base_axis}.propellant": Definition(
            "kg", "propellant for this axis", is_shown=False
        ),
        "sizing.peak_momentum": Definition(
            "N m s", "largest momentum that wheels have to hold", is_shown=False
        ),
        "sizing.thrusters.torque_share": Definition(
            "share",
            "largest share of the torque that thrusters without wheels can give",
            is_shown=False,
        ),
        "sizing.thrusters.propellant": Definition(
            "kg", "propellant of all thrusters", is_shown=False
        ),
    },
)
def sizing(flight: AnalysedLog) -> dict[str, float]:
    """Compute the demand on each axis of the base, and on each part of a set of actuators.

    Raises:
        InputError: the base floated freely, or what turned it is not known.
    """
    log, flown = flight.log, flight.actuators
    if not flown.controls_base:
        raise InputError("the base floated freely: nothing was asked of it")
    actuators, is_flown = flight.other_actuators or flown, flight.other_actuators is None
    loads: list[WheelLoad | ThrusterLoad] = []
    if actuators.wheel_count:
        loads.append(WheelLoad(actuators.wheels, log, is_flown))
    if actuators.thruster_count:
        are_alone = not actuators.wheel_count
        loads.append(ThrusterLoad(actuators.thrusters, log, are_alone, is_flown))
    demands, squares = BaseDemand(log, flown), np.zeros(3)
    torque, momentum, impulse, largest = np.zeros(3), np.zeros(3), np.zeros(3), 0.0
    for start, stop in flight.blocks():
        demand = demands.of(start, stop)
        squares += np.einsum("ij,ij->j", demand.torque, demand.torque)
        torque = np.maximum(torque, np.abs(demand.torque).max(axis=0))
        momentum = np.maximum(momentum, np.abs(demand.momentum).max(axis=0))
        impulse += flight.period * np.sum(np.abs(demand.torque), axis=0)
        largest = max(largest, float(np.linalg.norm(demand.momentum, axis=1).max()))
        for load in loads:
            load.add(start, stop, demand)
    numbers = {"peak_momentum": largest}
    for i, axis in enumerate(BASE_AXES):
        numbers |= {
            f"{axis}.peak_torque": float(torque[i]),
            f"{axis}.rms_torque": float(np.sqrt(squares[i] / log.ticks)),
            f"{axis}.angular_impulse": float(impulse[i]),
            f"{axis}.peak_momentum": float(momentum[i]),
        }
    for load in loads:
        numbers |= load.numbers(flight.period)
    return {f"sizing.{name}": value for name, value in numbers.items()}


def load_requirements(
    actuators: BaseActuatorSettings, numbers: Mapping[str, float]
) -> Iterator[LoadRequirement]:
    """Yield what is asked of each part of actuators by the metrics, and what the part has."""

    def asked(part: str, key: str, quantity: str, unit: str, has: float) -> LoadRequirement:
        return LoadRequirement(part, quantity, unit, numbers[f"sizing.{part}.{key}"], has)

    wheels, thrusters = actuators.wheels, actuators.thrusters
    if not (wheels.count or thrusters.count):
        return
    for axis, has in zip(BASE_AXES, largest_torque(actuators), strict=True):
        yield asked(axis, "peak_torque", "peak torque", "N m", float(has))
    if wheels.count:
        for axis, has in zip(BASE_AXES, largest_momentum(wheels), strict=True):
            yield asked(axis, "peak_momentum", "stored momentum", "N m s", float(has))
    limits = wheels.limits("max_torque"), wheels.limits("max_momentum")
    for i, (torque, momentum) in enumerate(zip(*limits, strict=True)):
        part = f"wheel_{i + 1}"
        yield asked(part, "peak_torque", "peak torque", "N m", float(torque))
        yield asked(part, "peak_momentum", "largest momentum", "N m s", float(momentum))
    if thrusters.count and not wheels.count:
        yield asked("thrusters", "torque_share", "share of their torque", "-", 1.0)
    if "sizing.thrusters.propellant" in numbers:
        tank = thrusters.propellant or np.inf
        yield asked("thrusters", "propellant", "propellant", "kg", tank)


class BaseDemand:
    """Computes the demand on the base, of rows that are asked for in their order."""

    def __init__(self, log: FlightLog, flown: BaseActuatorSettings) -> None:
        """``flown``: what turned the base; the momentum of its wheels is known."""
        self._log, self._flown = log, flown
        self._taken: Array = np.zeros((3, 1))
        """N m s, inertial axes: what the base was given so far."""

    def of(self, start: int, stop: int) -> Demand:
        """Return the demand of the rows from ``start`` to before ``stop``."""
        torque = self._commanded(start, stop)
        if self._flown.wheel_count:
            momentum = self._held(start, stop)
        else:
            momentum = self._taken_up(start, stop, torque)
        return Demand(torque, momentum, self._log.omega_base[start:stop])

    def _commanded(self, start: int, stop: int) -> Array:
        """Return the torque commanded for the interval before each row, or else the one given."""
        torque = self._log.applied_torque[start:stop, :3]
        if self._log.commanded_torque is None:
            return torque
        commands = self._log.commanded_torque[max(start - 1, 0) : stop - 1, :3]
        if start == 0:
            commands = np.concatenate([np.full((1, 3), np.nan), commands])
        return np.where(np.isfinite(commands), commands, torque)

    def _taken_up(self, start: int, stop: int, torque: Array) -> Array:
        """Return what the wheels must have taken up, by the mean of an interval's two attitudes."""
        axes = axes_of(self._log.rows(max(start - 1, 0), stop))
        before = axes[:, :, :-1]
        if start == 0:
            before = np.concatenate([axes[:, :, :1], before], axis=2)
        else:
            axes = axes[:, :, 1:]
        impulse = self._log.timebase.period * to_inertial(0.5 * (axes + before), torque.T)
        if start == 0:  # the interval before the first row is not of this flight
            impulse[:, 0] = 0.0
        taken = self._taken + np.cumsum(impulse, axis=1)
        self._taken = taken[:, -1:].copy()
        return -to_base(axes, taken).T

    def _held(self, start: int, stop: int) -> Array:
        """Return what the flight's own wheels hold beyond what they held at its first row."""
        wheels = self._flown.wheels
        rows = self._log.rows(start, stop)
        held, axes = (
            product(wheels.spin_momenta(rows.wheel_velocities), wheels.unit_axes),
            axes_of(rows),
        )
        if start == 0:
            self._taken = to_inertial(axes[:, :, :1], held[:1].T)
        at_first = to_base(axes, np.broadcast_to(self._taken, (3, len(held)))).T
        return held - at_first


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


class WheelLoad:
    """Largest motor torque and momentum of each wheel: by the flight's columns, or by its demand.

    Wheels that did not fly share the demand by least squares of their loads, see `wheel_loads`.
    """

    def __init__(self, wheels: WheelSettings, log: FlightLog, is_flown: bool) -> None:
        self._wheels, self._log, self._is_flown = wheels, log, is_flown
        self._largest = np.zeros((2, wheels.count))
        """Torque, N m, and momentum, N m s."""

    def add(self, start: int, stop: int, demand: Demand) -> None:
        """Take further rows, and the demand in them."""
        motion = self.motion(start, stop, demand)
        self._largest = np.maximum(self._largest, [np.abs(x).max(axis=0) for x in motion])

    def motion(self, start: int, stop: int, demand: Demand) -> tuple[Array, Array]:
        """Return what the motors give, N m, and where they bring the wheels, N m s, (N, W) each."""
        if self._is_flown:
            return wheel_motion(self._log, start, stop, self._wheels)
        axes, at_first = axes_of(self._log.rows(start, stop)), axes_of(self._log.rows(0, 1))
        momentum = demand.momentum + carried_momentum(self._wheels, at_first, axes)
        torque, held = wheel_loads(self._wheels, demand.torque, momentum, demand.omega)
        return torque, held

    def numbers(self, period: float) -> dict[str, float]:
        """Return the metrics of every wheel."""
        return {
            f"wheel_{i + 1}.{key}": float(value)
            for key, values in zip(("peak_torque", "peak_momentum"), self._largest, strict=True)
            for i, value in enumerate(values)
        }


class ThrusterLoad:
    """Pulses, propellant, and the largest share of the torque that thrusters can give.

    Of thrusters that did not fly it is the least propellant, as if they were not on or off, and
    nothing beside wheels, since it is the allocation that shares the work out.
    """

    def __init__(
        self, thrusters: ThrusterSettings, log: FlightLog, are_alone: bool, is_flown: bool
    ) -> None:
        """``are_alone``: there are no wheels, so that the base's whole torque is theirs."""
        self._thrusters, self._log, self._is_flown = thrusters, log, is_flown
        self._torques = ThrusterTorques.of(thrusters) if are_alone else None
        self._share, self._rate = 0.0, 0.0
        """Of their torque; and kg/s, summed up over the ticks."""
        self._rate_of_axes: Array | None = np.zeros(3) if is_flown or are_alone else None
        """The same by axis; None: not known."""
        self._pulses = np.zeros(3, dtype=np.intp)

    def add(self, start: int, stop: int, demand: Demand) -> None:
        """Take further rows, and the demand in them."""
        if self._torques:
            self._share = max(self._share, float(np.max(self._torques.share(demand.torque))))
        if self._rate_of_axes is None:
            return
        if self._is_flown:
            rate = self._flown(start, stop)
            self._rate += float(np.sum(rate))
            self._rate_of_axes += product(rate, self._shares_of_axes())
        elif self._torques:
            self._rate += float(np.sum(self._torques.propellant(demand.torque)))
            for i in range(3):
                alone = np.zeros_like(demand.torque)
                alone[:, i] = demand.torque[:, i]
                self._rate_of_axes[i] += float(np.sum(self._torques.propellant(alone)))

    def numbers(self, period: float) -> dict[str, float]:
        """Return the metrics of all thrusters; ticks are ``period`` s apart.

        A pulse counts for the axis that its thruster turns the base about most, the propellant of a
        thruster for all axes, as its torque does.
        """
        numbers = {"thrusters.torque_share": self._share} if self._torques else {}
        if self._rate_of_axes is not None:
            numbers["thrusters.propellant"] = period * self._rate
            for axis, rate in zip(BASE_AXES, self._rate_of_axes.tolist(), strict=True):
                numbers[f"{axis}.propellant"] = period * rate
        if self._is_flown:
            for axis, pulses in zip(BASE_AXES, self._pulses.tolist(), strict=True):
                numbers[f"{axis}.pulses"] = float(pulses)
        return numbers

    def _flown(self, start: int, stop: int) -> Array:
        """Count pulses; return the mass flow (T,) of each thruster, summed up over the ticks."""
        is_open = self._log.thrusts[max(start - 1, 0) : stop] > 0.0
        if start == 0:
            is_open = np.concatenate([np.zeros((1, is_open.shape[1]), dtype=bool), is_open])
        begun = np.sum(is_open[1:] & ~is_open[:-1], axis=0)
        torques = np.abs(self._thrusters.torques)
        main = np.argmax(torques >= (1.0 - ROUNDING) * torques.max(axis=1)[:, None], axis=1)
        self._pulses += np.bincount(main, begun, minlength=3).astype(np.intp)
        shares = np.sum(self._log.thrusts[start:stop], axis=0) / self._thrusters.values("force")
        rate: Array = shares * self._thrusters.mass_flow
        return rate

    def _shares_of_axes(self) -> Array:
        torques = np.abs(self._thrusters.torques)
        shares: Array = torques / np.maximum(torques.sum(axis=1, keepdims=True), TINY)
        return shares
