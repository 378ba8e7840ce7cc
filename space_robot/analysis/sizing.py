"""Sizing: what a flight asks of its base, and whether a set of actuators has it.

Wheels that turn the base by a torque ``tau`` take up what they give: their momentum on inertial
axes falls by ``integral R tau dt`` whatever does the turning in this flight. So an ideal torque
tells what wheels would hold.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array, product
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
from .external_torques import body_axes
from .series import Definition, metrics


class ActuatorSet(NamedTuple):
    """Actuators that a flight may have had, or might have."""

    name: str
    """Of a file of config/actuators, or its path."""
    settings: BaseActuatorSettings


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
        """Return it for JSON, in which what is infinite is None."""
        return {
            **self._asdict(),
            "has": self.has if np.isfinite(self.has) else None,
            "margin": self.margin,
            "is_met": self.is_met,
            "is_at_limit": self.is_at_limit,
        }


@metrics(
    "sizing",
    {
        "sizing.{base_part}.peak_torque": Definition(
            "N m", "largest torque commanded about an axis of the base, or of a wheel's motor"
        ),
        "sizing.{base_part}.peak_momentum": Definition(
            "N m s", "largest momentum that wheels have to hold about an axis, or a wheel holds"
        ),
        "sizing.{base_axis}.rms_torque": Definition("N m", "RMS of the torque commanded"),
        "sizing.{base_axis}.angular_impulse": Definition(
            "N m s", "integral of the size of the torque commanded"
        ),
        "sizing.{base_axis}.pulses": Definition(
            "", "pulses of the thrusters that turn the base about this axis most"
        ),
        "sizing.{base_axis}.propellant": Definition("kg", "propellant for this axis"),
        "sizing.peak_momentum": Definition("N m s", "largest momentum that wheels have to hold"),
        "sizing.thrusters.torque_share": Definition(
            "share", "largest share of the torque that thrusters without wheels can give"
        ),
        "sizing.thrusters.propellant": Definition("kg", "propellant of all thrusters"),
    },
    is_shown=False,
)
def sizing(flight: AnalysedLog) -> dict[str, float]:
    """Compute the demand on each axis of the base, and on each part of a set of actuators.

    A pulse counts for the axis that its thruster turns the base about most, the propellant of a
    thruster for all axes, as its torque does. Of thrusters that did not fly it is the least
    propellant, as if they were not on or off, and nothing beside wheels, since it is the allocation
    that shares the work out.
    """
    log, flown = flight.log, flight.actuators
    if not flown.controls_base:
        raise InputError("the base floated freely: nothing was asked of it")
    actuators, is_flown = flight.other_actuators or flown, flight.other_actuators is None
    wheels, thrusters = actuators.wheels, actuators.thrusters
    only_thrusters = thrusters.count and not wheels.count
    torques = ThrusterTorques.of(thrusters) if only_thrusters else None
    demands = BaseDemand(log, flown)
    largest, sums = dict[str, Any](), dict[str, Any]()
    for start, stop in flight.blocks():
        demand = demands.of(start, stop)
        torque = np.abs(demand.torque)
        peaks: dict[str, Any] = {
            "torque": torque.max(axis=0),
            "momentum": np.abs(demand.momentum).max(axis=0),
            "whole momentum": np.linalg.norm(demand.momentum, axis=1).max(),
        }
        added: dict[str, Any] = {
            "squares": np.sum(torque**2, axis=0),
            "impulse": np.sum(torque, axis=0),
        }
        if wheels.count:
            motion = (
                wheel_motion(log, start, stop, wheels)
                if is_flown
                else other_wheels(wheels, log, start, demand)
            )
            peaks["wheels"] = np.array([np.abs(values).max(axis=0) for values in motion])
        if torques:
            peaks["share"] = np.max(torques.share(demand.torque))
        if is_flown and thrusters.count:
            pulses, flow = flown_thrusters(thrusters, log, start, stop)
            added |= {
                "pulses": pulses,
                "flow": np.sum(flow),
                "flow by axis": flow @ arms(thrusters),
            }
        elif torques:
            alone = (demand.torque * np.eye(3)[i] for i in range(3))
            flows = [np.sum(torques.propellant(asked)) for asked in (demand.torque, *alone)]
            added |= {"flow": flows[0], "flow by axis": np.array(flows[1:])}
        largest = {k: np.maximum(value, largest.get(k, value)) for k, value in peaks.items()}
        sums = {k: value + sums.get(k, 0.0) for k, value in added.items()}
    by_axis = {
        "peak_torque": largest["torque"],
        "rms_torque": np.sqrt(sums["squares"] / log.ticks),
        "angular_impulse": flight.period * sums["impulse"],
        "peak_momentum": largest["momentum"],
    }
    numbers = {"peak_momentum": largest["whole momentum"]}
    for i, axis in enumerate(BASE_AXES):
        numbers |= {f"{axis}.{name}": values[i] for name, values in by_axis.items()}
    if "wheels" in largest:
        for i, (peak_torque, peak_momentum) in enumerate(largest["wheels"].T):
            numbers[f"wheel_{i + 1}.peak_torque"] = peak_torque
            numbers[f"wheel_{i + 1}.peak_momentum"] = peak_momentum
    if "share" in largest:
        numbers["thrusters.torque_share"] = largest["share"]
    if "flow" in sums:
        numbers["thrusters.propellant"] = flight.period * sums["flow"]
        for axis, flow in zip(BASE_AXES, sums["flow by axis"], strict=True):
            numbers[f"{axis}.propellant"] = flight.period * flow
    if "pulses" in sums:
        for axis, pulses in zip(BASE_AXES, sums["pulses"], strict=True):
            numbers[f"{axis}.pulses"] = pulses
    return {f"sizing.{name}": float(value) for name, value in numbers.items()}


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
        self._log, self._wheels = log, flown.wheels
        self._taken: Array = np.zeros((3, 1))
        """N m s, inertial axes: what the base was given so far."""

    def of(self, start: int, stop: int) -> Demand:
        """Return the demand of the rows from ``start`` to before ``stop``."""
        torque = self._commanded(start, stop)
        if self._wheels.count:
            momentum = self._held_by_wheels(start, stop)
        else:
            momentum = self._taken_up(start, stop, torque)
        return Demand(torque, momentum, self._log.omega_base[start:stop])

    def _commanded(self, start: int, stop: int) -> Array:
        torque = self._log.applied_torque[start:stop, :3]
        if self._log.commanded_torque is None:
            return torque
        commands = self._log.commanded_torque[max(start - 1, 0) : stop - 1, :3]
        if start == 0:
            commands = np.concatenate([np.full((1, 3), np.nan), commands])
        return np.where(np.isfinite(commands), commands, torque)

    def _taken_up(self, start: int, stop: int, torque: Array) -> Array:
        axes = body_axes(self._log.rows(start, stop))
        first = body_axes(self._log.rows(max(start - 1, 0), max(start - 1, 0) + 1))
        mean_axes = 0.5 * (axes + np.concatenate([first, axes[:, :, :-1]], axis=2))
        impulse = self._log.timebase.period * to_inertial(mean_axes, torque.T)
        if start == 0:  # the interval before the first row is not of this flight
            impulse[:, 0] = 0.0
        taken = self._taken + np.cumsum(impulse, axis=1)
        self._taken = taken[:, -1:].copy()
        return -to_base(axes, taken).T

    def _held_by_wheels(self, start: int, stop: int) -> Array:
        rows, wheels = self._log.rows(start, stop), self._wheels
        held = product(wheels.spin_momenta(rows.wheel_velocities), wheels.unit_axes)
        axes = body_axes(rows)
        if start == 0:
            self._taken = to_inertial(axes[:, :, :1], held[:1].T)
        at_first = to_base(axes, np.broadcast_to(self._taken, (3, len(held)))).T
        return held - at_first


def other_wheels(
    wheels: WheelSettings, log: FlightLog, start: int, demand: Demand
) -> tuple[Array, Array]:
    """Return what wheels that did not fly would give, N m, and hold, N m s, (N, W) each.

    They share the demand in the rows from ``start`` on by least squares of their loads.
    """
    rows = log.rows(start, start + len(demand.torque))
    carried = carried_momentum(wheels, body_axes(log.rows(0, 1)), body_axes(rows))
    return wheel_loads(wheels, demand.torque, demand.momentum + carried, demand.omega)


def flown_thrusters(
    thrusters: ThrusterSettings, log: FlightLog, start: int, stop: int
) -> tuple[Array, Array]:
    """Return the pulses (3,) about each axis of some rows, and mass flows (T,), kg/s, summed up."""
    before = log.thrusts[max(start - 1, 0) : start] if start else np.zeros_like(log.thrusts[:1])
    is_open = np.concatenate([before, log.thrusts[start:stop]]) > 0.0
    begun = np.sum(is_open[1:] & ~is_open[:-1], axis=0)
    torques = np.abs(thrusters.torques)
    main = np.argmax(torques >= (1.0 - ROUNDING) * torques.max(axis=1)[:, None], axis=1)
    shares = np.sum(log.thrusts[start:stop], axis=0) / thrusters.values("force")
    pulses = np.bincount(main, begun, minlength=3).astype(np.float64)
    return pulses, shares * thrusters.mass_flow


def arms(thrusters: ThrusterSettings) -> Array:
    """Return the share (T, 3) of each thruster's torque that is about each axis."""
    torques = np.abs(thrusters.torques)
    shares: Array = torques / np.maximum(torques.sum(axis=1, keepdims=True), TINY)
    return shares
