"""Noisy and coarse sensors: what the controller is told instead of the plant's true state."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.samples import RobotState

from ..dynamics.attitude import quaternion_rate
from ..faults.grammar import Argument, Kind
from ..faults.schedule import Schedule, ScheduledFault

Array = NDArray[np.float64]

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])

_RAD = Argument("SIGMA", "rad", 0.0, 1e3)
_RAD_PER_S = Argument("SIGMA", "rad/s", 0.0, 1e3)
_RAD_STEP = Argument("STEP", "rad", 1e-12, 1e3)
_RAD_PER_S_STEP = Argument("STEP", "rad/s", 1e-12, 1e3)


class SensorFault(ABC):
    """One way for sensors to be wrong."""

    FIELDS: ClassVar[Mapping[Kind, str]]
    """The field of `RobotState` that each kind of fault spoils."""

    def __init__(self, schedule: Schedule) -> None:
        self._faults = [
            (fault, field) for kind, field in self.FIELDS.items() for fault in schedule.of(kind)
        ]

    def spoil(self, measured: RobotState, tick: int) -> None:
        """Change in place what is measured at a tick; the echo of the torque is left alone."""
        for fault, field in self._faults:
            if fault.acts_at(tick):
                values: Array = getattr(measured, field)
                change = self.turn if field == "quaternion" else self.change
                values[:] = change(values, fault, tick)

    @abstractmethod
    def turn(self, quaternion: Array, fault: ScheduledFault, tick: int) -> Array:
        """Return what is measured instead of the base's attitude."""

    @abstractmethod
    def change(self, values: Array, fault: ScheduledFault, tick: int) -> Array:
        """Return what is measured instead of angles or velocities."""


class Noise(SensorFault):
    """White normal noise, one draw an axis and tick."""

    FIELDS: ClassVar[Mapping[Kind, str]] = {
        Kind("noise_attitude", _RAD, None,
             "the measured attitude is turned by SIGMA about each axis"): "quaternion",
        Kind("noise_gyro", _RAD_PER_S, None, "noise on the measured base rate"): "omega_base",
        Kind("noise_joint_position", _RAD, None,
             "noise on the measured joint angles"): "joint_positions",
        Kind("noise_joint_velocity", _RAD_PER_S, None,
             "noise on the measured joint velocities"): "joint_velocities",
    }  # fmt: skip

    def turn(self, quaternion: Array, fault: ScheduledFault, tick: int) -> Array:
        """See `SensorFault.turn`."""
        return turned(quaternion, fault.noise(tick, 3))

    def change(self, values: Array, fault: ScheduledFault, tick: int) -> Array:
        """See `SensorFault.change`."""
        return values + fault.noise(tick, values.size)


class Quantisation(SensorFault):
    """Whole steps, as a converter gives them."""

    FIELDS: ClassVar[Mapping[Kind, str]] = {
        Kind("quantise_attitude", _RAD_STEP, None,
             "the measured attitude's rotation vector comes in steps"): "quaternion",
        Kind("quantise_gyro", _RAD_PER_S_STEP, None,
             "the measured base rate comes in steps"): "omega_base",
        Kind("quantise_joint_position", _RAD_STEP, None,
             "the measured joint angles come in steps"): "joint_positions",
        Kind("quantise_joint_velocity", _RAD_PER_S_STEP, None,
             "the measured joint velocities come in steps"): "joint_velocities",
    }  # fmt: skip

    def turn(self, quaternion: Array, fault: ScheduledFault, tick: int) -> Array:
        """See `SensorFault.turn`."""
        return turned(IDENTITY, in_steps(rotation_vector(quaternion), fault.value))

    def change(self, values: Array, fault: ScheduledFault, tick: int) -> Array:
        """See `SensorFault.change`."""
        return in_steps(values, fault.value)


FAULTS: tuple[type[SensorFault], ...] = (Noise, Quantisation)
"""All faults of sensors, in the order in which they act: a converter stands behind a sensor."""


class SensorFaults:
    """All faults of a flight's sensors."""

    def __init__(self, schedule: Schedule, n: int) -> None:
        self._faults = [fault(schedule) for fault in FAULTS]
        self._measured = RobotState.allocate(n)

    def measure(self, state: RobotState) -> RobotState:
        """Return what the sensors make of the true ``state``; the same object at every call."""
        tick, measured = state.tick, self._measured
        measured.tick = tick
        measured.block[:] = state.block
        for fault in self._faults:
            fault.spoil(measured, tick)
        return measured


def in_steps(values: Array, step: float) -> Array:
    """Round to the nearest whole multiples of ``step``."""
    return step * np.round(values / step)


def turned(quaternion: Array, rotation: Array) -> Array:
    """Turn ``quaternion`` by a rotation vector on inertial axes, rad."""
    change = np.empty(4)
    quaternion_rate(quaternion, rotation, change)  # exp(rotation / 2) = cos + sinc rotation / 2
    half = 0.5 * float(np.linalg.norm(rotation))
    result: Array = np.cos(half) * quaternion + np.sinc(half / np.pi) * change
    return result


def rotation_vector(quaternion: Array) -> Array:
    """Return axis times angle of a unit quaternion, rad; up to 2 pi, so that its sign is kept."""
    sine = float(np.linalg.norm(quaternion[1:]))
    angle = 2.0 * np.arctan2(sine, quaternion[0])
    return quaternion[1:] * (angle / sine) if sine else np.zeros(3)
