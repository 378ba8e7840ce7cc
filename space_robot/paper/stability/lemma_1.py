"""Lemma 1 along a flight: contraction by ``W = E - H_S^-1 h_bar`` (69).

By (68) the time-delay error obeys ``eps(t) = W eps(t - delta) + chi(t - delta)``. The lemma
requires a spectral norm of W below 1. W is not symmetric, but ``H_S^1/2 W H_S^-1/2`` is, so the
spectral radius of W is its norm induced by H_S: if it is below 1, W contracts in that norm even if
not in the Euclidean one. Both are computed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.attitude import attitude_error_into
from space_robot_model.dynamics.rho_space import RhoSpaceModel, rho_space_into
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

from ...tuning.spectrum import contraction_matrix
from .check import Check

Array = NDArray[np.float64]

SAMPLING = 0.02
"""Time between two evaluated configurations, s."""


class Extremes(NamedTuple):
    """Largest and smallest value over a flight, and their times."""

    max: float
    max_at_s: float
    min: float
    min_at_s: float

    @classmethod
    def of(cls, values: Array, time: Array) -> Extremes:
        """Return the extremes of ``values`` (K,) at ``time`` (K,), s."""
        high, low = int(np.argmax(values)), int(np.argmin(values))
        return cls(float(values[high]), float(time[high]), float(values[low]), float(time[low]))


@dataclass(frozen=True)
class Contraction:
    """Spectral norm and spectral radius of W over a flight."""

    norm: Extremes
    """Spectral norm, the largest singular value."""
    radius: Extremes
    """Spectral radius, the largest |eigenvalue|."""

    @property
    def norm_below_one(self) -> Check:
        """Lemma 1 as printed."""
        return Check(self.norm.max, 1.0)

    @property
    def radius_below_one(self) -> Check:
        """The condition that the recursion (68) needs at a fixed configuration."""
        return Check(self.radius.max, 1.0)


def inertia_along(robot: Robot, log: FlightLog, ticks: NDArray[np.intp]) -> Array:
    """Return H_S (K, m, m) of ``robot`` in the configurations at ``ticks`` (K,) of a flight.

    Passive joints are locked.
    """
    nominal, model = robot.nominal.model, RhoSpaceModel.allocate(robot.n)
    inertia, error, still = np.empty((len(ticks), log.axes, log.axes)), np.zeros(4), np.zeros(3)
    for k, tick in enumerate(ticks):
        attitude_error_into(log.reference_base[tick, :4], log.quaternion[tick], error)
        rho_space_into(
            nominal,
            error,
            log.joint_positions[tick],
            log.omega_base[tick],
            log.joint_velocities[tick],
            still,
            still,
            model,
        )
        inertia[k] = model.inertia
    return inertia


def contraction(robot: Robot, h_bar: Array, log: FlightLog) -> Contraction:
    """Return norm and radius of W along ``log``.

    Args:
        robot: the robot that flew, with its payload.
        h_bar: (m,) diagonal of h_bar.
        log: the flight, evaluated every `SAMPLING` seconds.
    """
    period = log.timebase.period
    ticks = np.arange(0, log.ticks, max(1, round(SAMPLING / period)))
    w = contraction_matrix(inertia_along(robot, log, ticks), h_bar)
    norm = np.asarray(np.linalg.norm(w, 2, axis=(1, 2)), dtype=np.float64)
    radius = np.asarray(np.max(np.abs(np.linalg.eigvals(w)), axis=1), dtype=np.float64)
    time = ticks.astype(np.float64) * period
    return Contraction(Extremes.of(norm, time), Extremes.of(radius, time))
