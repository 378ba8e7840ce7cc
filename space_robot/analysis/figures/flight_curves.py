"""What figures of several flights draw of each; the logs need not stay in memory."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..analysed_log import AnalysedLog, PointingBudget
from ..described import event_times
from ..errors import AxisIndex, controls_base
from ..plotted import PlottedQuantity, quantities_of
from ..torques import RippleSpectrum, ripple_spectrum
from ..waypoints import junction_ticks

Array = NDArray[np.float64]

DRAWN = ("attitude", "joints", "pointing", "tool", "base", "torques")
"""Kinds of quantities whose sizes are drawn over time."""


class BaseTorque(NamedTuple):
    """The base's torque over a flight: a fiftieth of its log, to hand from process to process."""

    torque: Array
    """(N, 3) N m, applied in the base frame."""
    period: float
    """s, of a tick."""
    junctions: NDArray[np.intp]
    """Rows at which one motion has ended and another begins."""
    start: float = 0.0
    """s, time of the first row: not 0 in an excerpt of a flight."""

    @classmethod
    def of(cls, log: FlightLog) -> Self:
        """Copy it from a whole flight or an excerpt."""
        period = log.timebase.period
        return cls(
            log.applied_torque[:, :3].copy(), period, junction_ticks(log), log.first_tick * period
        )

    @property
    def time(self) -> Array:
        """Times of the rows, (N,) s."""
        return self.start + np.arange(len(self.torque), dtype=np.float64) * self.period

    @property
    def end(self) -> float:
        """End of the flight, s."""
        return self.start + len(self.torque) * self.period


class SizeCurve(NamedTuple):
    """Size of a quantity at each tick."""

    kind: str
    label: str
    """Title and unit."""
    size: Array
    """(N,)."""
    is_error: bool
    limits: Sequence[float]

    @classmethod
    def of(cls, kind: str, quantity: PlottedQuantity) -> Self:
        """Return the norm of the quantity over its axes."""
        return cls(kind, quantity.label, quantity.size, quantity.is_error, quantity.limits)


class FlightCurves(NamedTuple):
    """Sizes of a flight's quantities over time, its base torque, ripple and latency."""

    time: Array
    """(N,) s."""
    sizes: list[SizeCurve]
    """Of the kinds in `DRAWN`."""
    base_torque: BaseTorque | None
    """None where nothing turned the base."""
    latency_ms: Array | None
    """(K,) of every answer, by the wall clock; None for flights without any."""
    ripple: RippleSpectrum | None
    """None where the robot is not known, or the flight is too short."""
    torque_axes: dict[str, AxisIndex]
    """The axes of each column of torques."""
    events: Array
    """Times of what was captured and released, s."""

    @classmethod
    def of(cls, log: FlightLog, budget: PointingBudget | None = None) -> Self:
        """Compute them from a whole flight or an excerpt.

        ``budget``: of the base's pointing; None: the default.
        """
        flight = AnalysedLog(log, budget)
        ripple = latency = None
        with suppress(InputError):
            ripple = ripple_spectrum(flight)
        if log.latency_s is not None:
            known = log.latency_s[np.isfinite(log.latency_s)]
            latency = 1e3 * known if len(known) else None
        return cls(
            log.time,
            [SizeCurve.of(kind, quantity) for kind, quantity in quantities_of(flight, DRAWN)],
            BaseTorque.of(log) if controls_base(log) else None,
            latency,
            ripple,
            flight.torque_columns,
            event_times(log),
        )
