"""Sizing: what a flight asks of its base, and whether a set of actuators has it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_msgs_py.bag.flight_log import FlightLog, Metric
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES

from ..flight.capability import largest_momentum, largest_torque
from .base_demand import BaseDemand
from .loads import Load, LoadRequirement, OtherThrusterLoad, OtherWheelLoad, ThrusterLoad, WheelLoad
from .metrics import AxisMaximum, AxisRms

Array = NDArray[np.float64]


class ActuatorSet(NamedTuple):
    """Actuators that a flight may have had, or might have."""

    name: str
    """Of a file of config/actuators, or its path."""
    settings: BaseActuatorSettings


class Sizing(Metric):
    """Sums up what is asked of each axis of the base, and of each part of a set of actuators."""

    def __init__(
        self, log: FlightLog, flown: ActuatorSet, other: ActuatorSet | None = None
    ) -> None:
        """Begin without rows.

        Args:
            log: the first rows.
            flown: what turned the base.
            other: what is asked after in its place.

        Raises:
            InputError: the base floated freely.
        """
        if not flown.settings.controls_base:
            raise InputError("the base floated freely: nothing was asked of it")
        self._period, self._is_flown = log.timebase.period, other is None
        self._name, self._set = other or flown
        self._demand = BaseDemand(flown.settings)
        self._rms, self._torque, self._momentum = AxisRms(3), AxisMaximum(3), AxisMaximum(3)
        self._impulse, self._largest = np.zeros(3), 0.0
        wheels, thrusters = self._set.wheels, self._set.thrusters
        self._thrusters: ThrusterLoad | None = None
        self._loads: list[Load] = []
        if wheels.count:
            self._loads.append((WheelLoad if self._is_flown else OtherWheelLoad)(wheels))
        if thrusters.count:
            kind = ThrusterLoad if self._is_flown else OtherThrusterLoad
            self._thrusters = kind(thrusters, not wheels.count)
            self._loads.append(self._thrusters)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        demand = self._demand.add(log)
        self._rms.add(demand.torque)
        self._torque.add(demand.torque)
        self._momentum.add(demand.momentum)
        self._impulse += self._period * np.sum(np.abs(demand.torque), axis=0)
        self._largest = max(self._largest, float(np.linalg.norm(demand.momentum, axis=1).max()))
        for load in self._loads:
            load.add(log, demand)

    def result(self) -> dict[str, Any]:
        """Return the demand by axis, and whether the parts of the set have what is asked of them.

        ``requirements`` is empty where there is no set; ``has`` is None where it has no limit.
        """
        pulses = self._thrusters.pulses() if self._thrusters else None
        propellant = self._thrusters.propellant(self._period) if self._thrusters else None
        return {
            "actuators": self._name,
            "flown": self._is_flown,
            "axes": {
                axis: {
                    "peak_torque_n_m": float(self._torque.value[i]),
                    "rms_torque_n_m": float(self._rms.value[i]),
                    "angular_impulse_n_m_s": float(self._impulse[i]),
                    "peak_momentum_n_m_s": float(self._momentum.value[i]),
                    "pulses": None if pulses is None else int(pulses[i]),
                    "propellant_kg": None if propellant is None else float(propellant[i]),
                }
                for i, axis in enumerate(BASE_AXES)
            },
            "peak_momentum_n_m_s": self._largest,
            "requirements": [_as_data(requirement) for requirement in self._requirements()],
        }

    def _requirements(self) -> Iterator[LoadRequirement]:
        if not self._loads:
            return
        torque = largest_torque(self._set)
        for i, axis in enumerate(BASE_AXES):
            asked = float(self._torque.value[i])
            yield LoadRequirement(axis, "peak torque", "N m", asked, float(torque[i]))
        if self._set.wheel_count:
            momentum = largest_momentum(self._set.wheels)
            for i, axis in enumerate(BASE_AXES):
                asked = float(self._momentum.value[i])
                yield LoadRequirement(axis, "stored momentum", "N m s", asked, float(momentum[i]))
        for load in self._loads:
            yield from load.requirements(self._period)


def _as_data(requirement: LoadRequirement) -> dict[str, Any]:
    has = requirement.has if np.isfinite(requirement.has) else None
    return {
        **requirement._asdict(),
        "has": has,
        "margin": requirement.margin,
        "is_met": requirement.is_met,
        "is_at_limit": requirement.is_at_limit,
    }
