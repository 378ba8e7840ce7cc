"""Errors and torques beside the scene, of one flight or of several together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import cycle

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog

from ..analysis.attitude_drift import controls_base
from ..analysis.figures.overlay import words
from ..analysis.metrics import AxisIndex, error_columns, torque_columns, tracking_error, unit_of
from ..analysis.plot_series import tick_times
from .page import Plot, Series

Array = NDArray[np.float64]

STRETCHES = 600
"""Of a flight; of each the lowest and the highest value is drawn, so that no chatter is lost."""
AXES = "xyz"


def plots_of(flights: Mapping[str, FlightLog], colours: Sequence[str]) -> list[Plot]:
    """Return the plots of some flights.

    Of one flight each axis is drawn, of several the size of each column of Table V.

    Args:
        flights: by name.
        colours: of the flights; of one flight those of the axes.
    """
    logs = list(flights.values())
    edges = np.linspace(
        min(float(tick_times(log)[0]) for log in logs),
        max(float(tick_times(log)[-1]) for log in logs),
        STRETCHES + 1,
    )
    time = np.repeat(edges[:-1], 2)
    time[1::2] += 0.5 * (edges[1] - edges[0])
    by_name = [dict(_columns(log)) for log in logs]
    errors = {name for log in logs for name in _error_columns(log)}
    found = []
    for name in dict.fromkeys(name for columns in by_name for name in columns):
        series = []
        for flight, log, columns, colour in zip(
            flights, logs, by_name, cycle(colours), strict=False
        ):
            if name not in columns:
                continue
            labels, values = columns[name]
            if len(logs) > 1:
                size = np.linalg.norm(values, axis=1)
                series.append(Series(flight, colour, _extremes(log, size, edges)))
                continue
            for axis, label, its in zip(values.T, labels, cycle(colours), strict=False):
                series.append(Series(label, its, _extremes(log, axis, edges)))
        is_error = name in errors
        found.append(
            Plot(
                f"{words(name)} error" if is_error else words(name), unit_of(name).strip("-"), time,
                series, is_error and len(logs) > 1,
            )
        )  # fmt: skip
    return found


def _columns(log: FlightLog) -> Iterator[tuple[str, tuple[Sequence[str], Array]]]:
    """Yield the columns of Table V: name, names of the axes, values."""
    torques = torque_columns(log.axes, controls_base(log), log.prismatic, log.branches)
    names = np.array([*AXES, *log.joint_names])
    for columns, values in (
        (_error_columns(log), tracking_error(log)), (torques, log.applied_torque),
    ):  # fmt: skip
        for name, axes in columns.items():
            yield name, (names[axes].tolist(), values[:, axes])


def _error_columns(log: FlightLog) -> Mapping[str, AxisIndex]:
    return error_columns(log.axes, controls_base(log), log.prismatic, log.branches)


def _extremes(log: FlightLog, values: Array, edges: Array) -> Array:
    """Return the lowest and the highest of the values in each stretch, in turn, (2 K,); or NaN."""
    starts = np.searchsorted(tick_times(log), edges[:-1])
    found = np.full((len(starts), 2), np.nan)
    inside = np.flatnonzero(np.diff(np.append(starts, len(values))) > 0)
    if len(inside):
        finite = np.where(np.isfinite(values), values, np.nan)
        low = np.minimum.reduceat(finite, starts[inside])
        high = np.maximum.reduceat(finite, starts[inside])
        found[inside] = np.column_stack([low, high])
    return found.ravel()
