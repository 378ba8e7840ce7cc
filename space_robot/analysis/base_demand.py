"""Demand of a flight on its base, tick by tick: torque, and momentum of wheels.

Wheels that turn the base by a torque ``tau`` take up what they give: their momentum on inertial
axes falls by ``integral R tau dt`` whatever does the turning in this flight. So an ideal torque
tells what wheels would hold.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import product, unit_rows
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot.placements import base_axes, to_base, to_inertial
from space_robot_msgs_py.bag.flight_log import FlightLog

Array = NDArray[np.float64]


class Demand(NamedTuple):
    """Demand on the base in the base frame, one row per tick."""

    torque: Array
    """(N, 3) N m asked over the interval that ended at the tick: commanded, or given where no
    command is known."""
    momentum: Array
    """(N, 3) N m s that wheels hold at the tick beyond those of the flight's first one."""
    omega: Array
    """(N, 3) rad/s of the base."""


class BaseDemand:
    """Computes the demand of a flight, block by block."""

    def __init__(self, flown: BaseActuatorSettings) -> None:
        """``flown``: what turned the base; the momentum of its wheels is known."""
        self._flown = flown
        self._axes: Array | None = None
        """(3, 3, 1) the base's axes at the last row."""
        self._command = np.full((1, 3), np.nan)
        """The answer to the last row."""
        self._taken: Array = np.zeros((3, 1))
        """N m s, inertial axes: what the base was given so far."""

    def add(self, log: FlightLog) -> Demand:
        """Add further rows of the flight and return their demand."""
        axes = axes_of(log)
        torque = self._asked(log)
        momentum = (
            self._held(log, axes) if self._flown.wheel_count else self._given(log, axes, torque)
        )
        self._axes = axes[:, :, -1:].copy()
        return Demand(torque, momentum, log.omega_base)

    def _asked(self, log: FlightLog) -> Array:
        """Return the torque commanded for the interval before each row, or else the one given."""
        torque = log.applied_torque[:, :3]
        if log.commanded_torque is None:
            return torque
        commands = np.concatenate([self._command, log.commanded_torque[:, :3]])
        self._command = commands[-1:].copy()
        return np.where(np.isfinite(commands[:-1]), commands[:-1], torque)

    def _given(self, log: FlightLog, axes: Array, torque: Array) -> Array:
        """Return what the wheels must have taken up, by the mean of an interval's two attitudes."""
        before = axes[:, :, :1] if self._axes is None else self._axes
        middle = 0.5 * (axes + np.concatenate([before, axes[:, :, :-1]], axis=2))
        impulse = log.timebase.period * to_inertial(middle, torque.T)
        if self._axes is None:  # the interval before the first row is not of this flight
            impulse[:, 0] = 0.0
        taken = self._taken + np.cumsum(impulse, axis=1)
        self._taken = taken[:, -1:].copy()
        return -to_base(axes, taken).T

    def _held(self, log: FlightLog, axes: Array) -> Array:
        """Return what the flight's own wheels hold beyond what they held at its first row."""
        wheels = self._flown.wheels
        held = product(wheels.spin_momenta(log.wheel_velocities), wheels.unit_axes)
        if self._axes is None:
            self._taken = to_inertial(axes[:, :, :1], held[:1].T)
        at_first = to_base(axes, np.broadcast_to(self._taken, (3, len(held)))).T
        return held - at_first


def axes_of(log: FlightLog) -> Array:
    """Return the base's axes on inertial ones, (3, 3, N), see `base_axes`."""
    return base_axes(unit_rows(log.quaternion).T)
