"""Selected metrics of the ticks within a time window, accumulated block by block."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

from ...analysis.metrics import AxisRms
from ...analysis.pointing import BasePointing, BasePointingError, PointingBudget
from ...analysis.ripple import FAST, Ripple
from .columns import (
    ANGLE,
    FAST_RIPPLE,
    JITTER_MAX,
    JITTER_RMS,
    OUTSIDE,
    POINTING,
    RIPPLE,
    Columns,
    missing_for_ripple,
)

Array = NDArray[np.float64]


class Window(NamedTuple):
    """Time window of a flight; both ends are included."""

    from_s: float = 0.0
    to_s: float | None = None
    """None: to the end of the flight."""

    def ticks(self, ticks: int, period: float) -> range:
        """Return the ticks of a flight within the window.

        Args:
            ticks: number of ticks of the flight.
            period: of the ticks, s.
        """
        start, stop = int(np.ceil(self.from_s / period - 1e-6)), ticks
        if self.to_s is not None:
            stop = int(np.floor(self.to_s / period + 1e-6)) + 1
        return range(min(max(start, 0), ticks), min(max(stop, 0), ticks))

    def rows(self, log: FlightLog) -> slice:
        """Return the rows of a block within the window."""
        first = log.first_tick
        within = self.ticks(first + log.ticks, log.timebase.period)
        return slice(max(within.start - first, 0), max(within.stop - first, 0))


class WindowMetrics:
    """Accumulates selected metrics of a window of one flight."""

    def __init__(
        self,
        window: Window,
        wanted: Collection[str],
        columns: Columns,
        budget: PointingBudget | None = None,
    ) -> None:
        """Start without rows.

        Args:
            window: of the flight.
            wanted: names of the selected metrics.
            columns: of the flight.
            budget: of the base's pointing; None: the default.
        """
        self._window, self._wanted, self._columns = window, wanted, columns
        self._rms: tuple[AxisRms, AxisRms] | None = None
        self._of_poses = AxisRms(len(columns.of_poses))
        self._largest: dict[str, float] = {}
        self._ripple: Ripple | None = None
        self._budget = budget
        self._angles = AxisRms(3)
        self._pointing: BasePointing | None = None
        self._has_pointing = any(name.startswith((ANGLE, *POINTING)) for name in wanted)
        self._ticks, self._period = 0, 0.0
        self._has_ripple = any(name.startswith((RIPPLE, FAST_RIPPLE)) for name in wanted)
        self._has_rms = any(name.endswith("_rms") for name in wanted)

    def add(
        self,
        log: FlightLog,
        error: Array,
        sizes: dict[str, Array],
        robot: Robot,
        pointing: BasePointingError | None = None,
    ) -> None:
        """Add the next block.

        Args:
            log: its rows.
            error: (N, n+3) tracking error.
            sizes: magnitudes of its columns, see `Columns.sizes`.
            robot: of the flight.
            pointing: of the base; None: nothing controls its attitude.
        """
        rows = self._window.rows(log)
        if rows.start >= rows.stop:
            return
        if rows.stop - rows.start < log.ticks:
            log, error = log.rows(rows.start, rows.stop), error[rows]
        if self._has_rms:
            self._rms = self._rms or (AxisRms(log.axes), AxisRms(log.axes))
            for rms, values in zip(self._rms, (error, log.applied_torque), strict=True):
                rms.add(values)
            if names := self._columns.of_poses:
                self._of_poses.add(np.column_stack([sizes[name][rows] for name in names]))
        for name, size in sizes.items():
            if f"{name}_max" in self._wanted:
                self._largest[name] = max(
                    self._largest.get(name, 0.0), float(np.max(size[rows], initial=0.0))
                )
        if self._has_pointing and pointing is not None:
            within = BasePointingError(*(values[rows] for values in pointing))
            self._angles.add(np.degrees(within.vector))
            self._pointing = self._pointing or BasePointing(log, self._budget)
            self._pointing.add_error(within)
        if self._has_ripple:
            self._ripple = self._ripple or Ripple(log, robot)
            self._ripple.add(log, error)
            self._ticks += log.ticks
            self._period = log.timebase.period

    def result(self) -> dict[str, float]:
        """Return the available metrics of the window, by name."""
        values_by_name = (
            {f"{name}_max": value for name, value in self._largest.items()}
            | self._ripples()
            | self._of_pointing()
        )
        if self._rms:
            both = self._columns.errors, self._columns.torques
            for rms, columns in zip(self._rms, both, strict=True):
                values = rms.value
                values_by_name |= {
                    f"{name}_rms": float(np.mean(values[ax])) for name, ax in columns.items()
                }
            of_poses = zip(self._columns.of_poses, self._of_poses.value, strict=True)
            values_by_name |= {f"{name}_rms": float(value) for name, value in of_poses}
        return {
            name: values_by_name[name]
            for name in self._wanted
            if np.isfinite(values_by_name.get(name, np.nan))
        }

    def _of_pointing(self) -> dict[str, float]:
        if self._pointing is None:
            return {}
        report = self._pointing.result()
        values = {
            f"{ANGLE}_rms": float(np.mean(self._angles.value)),
            OUTSIDE: 1.0 - report[POINTING[0]]["within_band"],
        }
        for name in POINTING:
            values[f"{name}_rms"] = report[name]["rms"]
            for kind in (JITTER_RMS, JITTER_MAX):
                if (jitter := report[name][kind[1:]]) is not None:
                    values[f"{name}{kind}"] = jitter
        return values

    def _ripples(self) -> dict[str, float]:
        if self._ripple is None or missing_for_ripple(RIPPLE, self._ticks, self._period):
            return {}
        spectrum = self._ripple.spectrum()
        bands = ((RIPPLE, spectrum.rms()), (FAST_RIPPLE, spectrum.rms(FAST)))
        values = {
            f"{prefix}{name}": float(np.mean(rms[axes]))
            for prefix, rms in bands
            for name, axes in self._columns.torques.items()
        }
        return {
            name: value
            for name, value in values.items()
            if not missing_for_ripple(name, self._ticks, self._period)
        }
