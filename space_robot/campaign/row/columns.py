"""The columns of Table V of a flight, their magnitudes at each tick, and the metrics of rows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import norms
from space_robot_msgs_py.bag.flight_log import FlightLog

from ...analysis.attitude_drift import controls_base
from ...analysis.metrics import AxisIndex, error_columns, largest_of_columns, torque_columns
from ...analysis.pointing import BASE_ANGLES, window_ticks
from ...analysis.ripple import FAST, SHORTEST_S, SLOWEST
from ...flight.plan import Flight

Array = NDArray[np.float64]

RIPPLE, FAST_RIPPLE = "ripple_", "fast_ripple_"
"""Prefixes of the names of ripple metrics; a torque column follows."""
DRIFT = "attitude_drift"
"""Angle by which a base without attitude control has turned since the first tick, rad."""
TOOL = ("tool", "tool_rotation")
"""Distance of the tool from its path, m, and angle to its orientation there, rad."""
ANGLE = "attitude_deg"
"""The attitude's error as angles, deg: RMS as of ``attitude``, magnitude of the whole rotation."""
POINTING = BASE_ANGLES[:2]
"""The base's half cone and its rotation about the axis that points, arcsec."""
OUTSIDE, JITTER_RMS, JITTER_MAX = f"{POINTING[0]}_outside_band", "_jitter_rms", "_jitter_max"
"""Share of time outside of the band; suffixes of the names of jitter metrics."""
OF_BASE = ("attitude", "base_torque")
"""Vector columns: their magnitude is the norm; of joints it is the largest absolute value."""


class Columns(NamedTuple):
    """The axes of each column, by name."""

    errors: dict[str, AxisIndex]
    torques: dict[str, AxisIndex]
    drift: tuple[str, ...] = ()
    """`DRIFT` if nothing controls the base's attitude."""
    tool: tuple[str, ...] = ()
    """`TOOL` if the mission leads the tool: its error, see `ToolError`."""

    @property
    def angles(self) -> tuple[str, ...]:
        """`ANGLE` and `POINTING` if something controls the base's attitude."""
        return () if self.drift else (ANGLE, *POINTING)

    @classmethod
    def of_flight(cls, flight: Flight) -> Columns:
        """Return the columns of a flight before it is flown."""
        robot = flight.robot
        kinds = robot.n + 3, flight.controls_base, tuple(robot.is_prismatic), robot.branches
        drift = () if flight.controls_base else (DRIFT,)
        tool = TOOL if flight.mission.leads_tool else ()
        return cls(error_columns(*kinds), torque_columns(*kinds), drift, tool)

    @classmethod
    def of_log(cls, log: FlightLog) -> Columns:
        """Return the columns of a flight log."""
        is_controlled = controls_base(log)
        kinds = log.axes, is_controlled, log.prismatic, log.branches
        drift = () if is_controlled else (DRIFT,)
        return cls(error_columns(*kinds), torque_columns(*kinds), drift)

    @property
    def names(self) -> tuple[str, ...]:
        """All columns: errors, then torques, the drift, those of the tool, and angles."""
        return (*self.errors, *self.torques, *self.of_poses, *self.angles)

    @property
    def of_poses(self) -> tuple[str, ...]:
        """Columns that are magnitudes already, and of no axes: drift and tool."""
        return (*self.drift, *self.tool)

    @property
    def metrics(self) -> tuple[str, ...]:
        """All metrics of a row, in the order of the table.

        ``<column>_rms``: mean over the axes of each axis' RMS, as in Table V.
        ``<column>_max``: the largest magnitude at any tick, see `sizes`. ``ripple_<torque column>``
        and ``fast_ripple_<torque column>``: RMS of the ripple above 2 Hz, and above 25 Hz. Of the
        base's pointing also `OUTSIDE` and jitter, see `BasePointing`.
        """
        return (
            *(f"{name}_rms" for name in self.names),
            *(f"{name}_max" for name in self.names),
            *(f"{RIPPLE}{name}" for name in self.torques),
            *(f"{FAST_RIPPLE}{name}" for name in self.torques),
            *self._of_pointing,
        )

    @property
    def _of_pointing(self) -> tuple[str, ...]:
        if self.drift:
            return ()
        return OUTSIDE, *(f"{name}{kind}" for name in POINTING for kind in (JITTER_RMS, JITTER_MAX))

    def sizes(self, log: FlightLog, error: Array) -> dict[str, Array]:
        """Compute the magnitude of each column at every tick, (N,).

        For the base it is the norm: of the error quaternion's vector part (half the angle, rad), or
        of the torque, N m. For the joints it is the largest absolute value.

        Args:
            log: rows of the flight.
            error: (N, n+3) tracking error.
        """
        return {
            name: (norms if name in OF_BASE else largest_of_columns)(values[:, axes])
            for values, columns in ((error, self.errors), (log.applied_torque, self.torques))
            for name, axes in columns.items()
        }


def missing_for_jitter(metric: str, ticks: int, period: float, window_s: float) -> str:
    """Return why a jitter metric cannot be computed; empty if it can.

    Args:
        metric: any metric's name.
        ticks: of the flight, or of a window in it.
        period: of the ticks, s.
        window_s: of the budget.
    """
    is_one = metric.startswith(POINTING) and metric.endswith((JITTER_RMS, JITTER_MAX))
    if not is_one or ticks >= window_ticks(window_s, period):
        return ""
    return f"needs {window_s:g} s of flight (pointing.window_s), got {ticks * period:g} s"


def missing_for_ripple(metric: str, ticks: int, period: float) -> str:
    """Return why a ripple metric cannot be computed; empty if it can.

    Args:
        metric: any metric's name.
        ticks: of the flight, or of a window in it.
        period: of the ticks, s.
    """
    if not metric.startswith((RIPPLE, FAST_RIPPLE)):
        return ""
    above = FAST if metric.startswith(FAST_RIPPLE) else SLOWEST
    if 0.5 / period <= above:
        return f"needs a period below {0.5 / above:g} s, got {period:g} s"
    if ticks * period < SHORTEST_S * (1.0 - 1e-9):
        return f"needs {SHORTEST_S:g} s of flight, got {ticks * period:g} s"
    return ""
