"""What became of the commands: limits reached, answers late, torques that were not commanded."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.flight_log import FlightLog

from .generalised_motion import measured_rows

Array = NDArray[np.float64]

PERCENTILES = {"p50": 50.0, "p99": 99.0, "max": 100.0}


class TorqueLimits(NamedTuple):
    """Of the actuators, N m; infinite: none."""

    base: float
    joint: float

    def of_axes(self, axes: int) -> Array:
        """(m,) each axis'."""
        return np.array([self.base] * 3 + [self.joint] * (axes - 3))


def saturated_ticks(log: FlightLog, limits: TorqueLimits) -> int:
    """Ticks at which the torque applied on some axis was at its limit.

    The plant clips to the limit, so "at" is exact but for the rounding of whoever recorded.
    """
    at_limit = np.abs(log.applied_torque) >= limits.of_axes(log.axes) * (1.0 - 1e-9)
    return int(np.count_nonzero(at_limit.any(axis=1)))


def latency(latency_s: Array, period: float) -> dict[str, float] | None:
    """Percentiles of the time from a state's sending to its answer's, by the wall clock.

    Args:
        latency_s: (N,) s, NaN where there was no answer.
        period: s, of a tick.

    Returns:
        ``p50_ms``, ``p99_ms``, ``max_ms``, the same as ``..._ticks``, and the ``answers`` they
        are of; None if there is not one.
    """
    known = latency_s[np.isfinite(latency_s)]
    if not len(known):
        return None
    values = dict(zip(PERCENTILES, np.percentile(known, list(PERCENTILES.values())), strict=True))
    return {
        **{f"{name}_ms": float(1e3 * value) for name, value in values.items()},
        **{f"{name}_ticks": float(value / period) for name, value in values.items()},
        "answers": len(known),
    }


def differing_commands(
    log: FlightLog, latency_ticks: int, limits: TorqueLimits
) -> tuple[int, int] | None:
    """Ticks after which the plant applied something else than what was commanded for them.

    The torque applied over the interval that begins at tick k is reported with the state of tick
    k+1; commanded for it was the answer to tick ``k - latency_ticks``, clipped to the limits. In
    lockstep they are the same to the last bit. By the wall clock the plant holds the command
    before where an answer is late.

    Returns:
        How many differ, and of how many that were compared (those with a command); None if no
        command is known.
    """
    if log.commanded_torque is None or np.isnan(log.commanded_torque).all():
        return None
    ends = slice(latency_ticks + 1, log.ticks)
    applied, limit = log.applied_torque[ends], limits.of_axes(log.axes)
    commanded = np.clip(log.commanded_torque[: len(applied)], -limit, limit)
    known = np.isfinite(commanded).all(axis=1) & measured_rows(log)[ends]
    differ = np.any(applied != commanded, axis=1) & known
    return int(np.count_nonzero(differ)), int(np.count_nonzero(known))
