"""Sizing: what a flight asks of its base, and whether a set of actuators has it.

Wheels that turn the base by a torque ``tau`` take up what they give: their momentum on inertial
axes falls by ``integral R tau dt`` whatever does the turning in this flight. So an ideal torque
tells what wheels would hold.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import product
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot.placements import to_base, to_inertial
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES

from ..flight.capability import largest_momentum, largest_torque
from .analysed_log import AnalysedLog
from .described import actuators_of
from .external_torques import axes_of
from .loads import Demand, Load, LoadRequirement, ThrusterLoad, loads_on

Array = NDArray[np.float64]


class ActuatorSet(NamedTuple):
    """Actuators that a flight may have had, or might have."""

    name: str
    """Of a file of config/actuators, or its path."""
    settings: BaseActuatorSettings


def sizing(flight: AnalysedLog, other: ActuatorSet | None = None) -> dict[str, Any]:
    """Return the demand on each axis, and whether the parts of a set have what is asked of them.

    ``requirements`` is empty where there is no set; ``has`` is None where it has no limit.

    Args:
        flight: that was flown.
        other: actuators to ask about in the place of those that flew.

    Raises:
        InputError: the base floated freely, or what turned it is not known.
    """
    log, flown = flight.log, flight.actuators
    if not flown.controls_base:
        raise InputError("the base floated freely: nothing was asked of it")
    name, asked = other or ActuatorSet(actuators_of(log), flown)
    loads = loads_on(asked, log, is_flown=other is None)
    demands, squares = BaseDemand(log, flown), np.zeros(3)
    torque, momentum, impulse, largest = np.zeros(3), np.zeros(3), np.zeros(3), 0.0
    period = log.timebase.period
    for start, stop in flight.blocks():
        demand = demands.of(start, stop)
        squares += np.einsum("ij,ij->j", demand.torque, demand.torque)
        torque = np.maximum(torque, np.abs(demand.torque).max(axis=0))
        momentum = np.maximum(momentum, np.abs(demand.momentum).max(axis=0))
        impulse += period * np.sum(np.abs(demand.torque), axis=0)
        largest = max(largest, float(np.linalg.norm(demand.momentum, axis=1).max()))
        for load in loads:
            load.add(start, stop, demand)
    thrusters = next((load for load in loads if isinstance(load, ThrusterLoad)), None)
    pulses = thrusters.pulses() if thrusters else None
    propellant = thrusters.propellant(period) if thrusters else None
    requirements = _requirements(asked, torque, momentum, loads, period)
    return {
        "actuators": name,
        "flown": other is None,
        "axes": {
            axis: {
                "peak_torque_n_m": float(torque[i]),
                "rms_torque_n_m": float(np.sqrt(squares[i] / log.ticks)),
                "angular_impulse_n_m_s": float(impulse[i]),
                "peak_momentum_n_m_s": float(momentum[i]),
                "pulses": None if pulses is None else int(pulses[i]),
                "propellant_kg": None if propellant is None else float(propellant[i]),
            }
            for i, axis in enumerate(BASE_AXES)
        },
        "peak_momentum_n_m_s": largest,
        "requirements": [requirement.as_data() for requirement in requirements],
    }


def _requirements(
    asked: BaseActuatorSettings, torque: Array, momentum: Array, loads: list[Load], period: float
) -> Iterator[LoadRequirement]:
    if not loads:
        return
    by_axis = [("peak torque", "N m", torque, largest_torque(asked))]
    if asked.wheel_count:
        held = largest_momentum(asked.wheels)
        by_axis.append(("stored momentum", "N m s", momentum, held))
    for quantity, unit, values, limits in by_axis:
        for axis, value, limit in zip(BASE_AXES, values.tolist(), limits, strict=True):
            yield LoadRequirement(axis, quantity, unit, value, float(limit))
    for load in loads:
        yield from load.requirements(period)


class BaseDemand:
    """Computes the demand on the base, of rows that are asked for in their order."""

    def __init__(self, log: FlightLog, flown: BaseActuatorSettings) -> None:
        """``flown``: what turned the base; the momentum of its wheels is known."""
        self._log, self._flown = log, flown
        self._taken: Array = np.zeros((3, 1))
        """N m s, inertial axes: what the base was given so far."""

    def of(self, start: int, stop: int) -> Demand:
        """Return the demand of the rows from ``start`` to before ``stop``."""
        torque = self._asked(start, stop)
        if self._flown.wheel_count:
            momentum = self._held(start, stop)
        else:
            momentum = self._given(start, stop, torque)
        return Demand(torque, momentum, self._log.omega_base[start:stop])

    def _asked(self, start: int, stop: int) -> Array:
        """Return the torque commanded for the interval before each row, or else the one given."""
        torque = self._log.applied_torque[start:stop, :3]
        if self._log.commanded_torque is None:
            return torque
        commands = self._log.commanded_torque[max(start - 1, 0) : stop - 1, :3]
        if start == 0:
            commands = np.concatenate([np.full((1, 3), np.nan), commands])
        return np.where(np.isfinite(commands), commands, torque)

    def _given(self, start: int, stop: int, torque: Array) -> Array:
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
