"""Series over a flight, the statistics of them, and the registry of all metrics.

A metric is named ``<column>.<statistic>``: ``joints_1_3.rms``, ``base_torque.ripple``. Most are
statistics of a series, declared with `series`; the others are functions, declared with `metrics`.
The declaration says each once: where names, units and texts are needed, they come from here.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array, norm, norms
from space_robot_msgs_py.errors import InputError

from .analysed_log import AnalysedLog
from .errors import AxisIndex

PLACEHOLDER = re.compile(r"{(\w+)}")


class Definition(NamedTuple):
    """Unit and meaning of a column of a series, or of a metric."""

    unit: str
    text: str
    statistics: tuple[str, ...] = ("rms", "max")
    """Of a column."""
    is_vector: bool = False
    """The size of a column at a tick is its norm; else its largest absolute value."""
    is_shown: bool = True
    """Whether tables of reports have it; all are in JSON."""


class TimeSeries(NamedTuple):
    """What a flight did over time."""

    axes: Mapping[str, AxisIndex]
    """Columns of the values, by name."""
    values: Callable[[int, int], Array]
    """Returns the values (stop - start, k) of the rows from ``start`` to before ``stop``; rows that
    are not known are NaN."""
    unknown: str = "no tick is known"
    """Why there are no statistics, where no row is known."""
    derive: Callable[[dict[str, float]], dict[str, float]] = lambda numbers: {}
    """Makes further metrics of the statistics."""


STATISTICS = {
    "rms": "root mean square, mean over the axes (Table V of the paper)",
    "rms_eq64": "a third of the vector's root mean square (eq. (64))",
    "max": "largest size: norm of a vector, largest absolute value of joints",
    "end": "size at the last tick",
}


@dataclass(frozen=True, eq=False)
class MetricGroup:
    """Metrics that are computed together."""

    name: str
    title: str
    quantities: Mapping[str, Definition]
    """By pattern of a metric's name, or of a series' column; `expand` fills ``{places}`` in."""

    def evaluate(self, flight: AnalysedLog, window: range) -> dict[str, float]:
        """Return the metrics of the rows in a window; without them InputError says why."""
        raise NotImplementedError

    def names(self, flight: AnalysedLog) -> list[str]:
        """Return the names of the metrics that a flight has; it need not have been flown."""
        raise NotImplementedError

    def describe(self) -> Iterator[tuple[str, Definition]]:
        """Yield pattern, unit and meaning of each metric."""
        yield from self.quantities.items()


@dataclass(frozen=True, eq=False)
class SeriesGroup(MetricGroup):
    """The statistics of a series."""

    source: Callable[[AnalysedLog], TimeSeries | None]
    derived: Mapping[str, Definition]

    def evaluate(self, flight: AnalysedLog, window: range) -> dict[str, float]:
        """Return the statistics over the known rows in a window."""
        series = self.source(flight)
        if series is None:
            return {}
        count, squares = 0, np.zeros(1)
        largest, last = dict.fromkeys(series.axes, 0.0), np.zeros((1, 0))
        for start, values in self._blocks(flight, series):
            rows = values[max(window.start - start, 0) : max(window.stop - start, 0)]
            sums = np.einsum("ij,ij->j", rows, rows)
            if np.isnan(sums).any():
                rows = rows[~np.isnan(rows).any(axis=1)]
                sums = np.einsum("ij,ij->j", rows, rows)
            if len(rows):
                count, squares, last = count + len(rows), squares + sums, rows[-1:].copy()
                for column, axes in series.axes.items():
                    size = float(self._size(column, rows[:, axes]).max())
                    largest[column] = max(largest[column], size)
        if not count:
            raise InputError(series.unknown)
        rms, numbers = np.sqrt(squares / count), dict[str, float]()
        for column, axes in series.axes.items():
            each = rms[axes]
            statistics = {
                "rms": float(np.mean(each)),
                "rms_eq64": norm(each) / len(each),
                "max": largest[column],
                "end": float(self._size(column, last[:, axes])[0]),
            }
            for name in self.quantity(column).statistics:
                numbers[f"{column}.{name}"] = statistics[name]
        return numbers | series.derive(numbers)

    def names(self, flight: AnalysedLog) -> list[str]:
        """Return a name for each statistic of each column."""
        if (series := self.source(flight)) is None:
            return []
        names = [f"{c}.{s}" for c in series.axes for s in self.quantity(c).statistics]
        return [*names, *self.derived]

    def describe(self) -> Iterator[tuple[str, Definition]]:
        """Yield each statistic of each column."""
        for column, quantity in self.quantities.items():
            for statistic in quantity.statistics:
                text = f"{quantity.text}: {STATISTICS[statistic]}"
                yield f"{column}.{statistic}", quantity._replace(text=text)
        yield from self.derived.items()

    def sizes(self, flight: AnalysedLog) -> Iterator[tuple[int, dict[str, Array]]]:
        """Yield the first row and the size of each column at each tick, block by block."""
        if series := self.source(flight):
            for start, values in self._blocks(flight, series):
                yield start, {c: self._size(c, values[:, axes]) for c, axes in series.axes.items()}

    def _blocks(self, flight: AnalysedLog, series: TimeSeries) -> Iterator[tuple[int, Array]]:
        for start, stop in flight.blocks():
            if (start, stop) != (0, flight.log.ticks):
                yield start, series.values(start, stop)
                continue
            if self.name not in flight.values:
                flight.values[self.name] = series.values(start, stop)
            yield start, flight.values[self.name]

    def quantity(self, column: str) -> Definition:
        """Return unit and meaning of a column."""
        return next(q for name, q in self.quantities.items() if fnmatchcase(column, pattern(name)))

    def _size(self, column: str, values: Array) -> Array:
        return norms(values) if self.quantity(column).is_vector else largest_sizes(values)


@dataclass(frozen=True, eq=False)
class FunctionGroup(MetricGroup):
    """Metrics that a function returns."""

    function: Callable[[AnalysedLog], dict[str, float]]
    applies: Callable[[AnalysedLog], bool]

    def evaluate(self, flight: AnalysedLog, window: range) -> dict[str, float]:
        """Return what the function makes of the rows in a window."""
        return self.function(flight.part(window)) if self.applies(flight) else {}

    def names(self, flight: AnalysedLog) -> list[str]:
        """Return the names, with all places filled in."""
        if not self.applies(flight):
            return []
        return [name for template in self.quantities for name in expand(template, flight)]


def largest_sizes(values: Array) -> Array:
    """(N,) largest absolute value of each row."""
    size: Array = np.abs(values[:, 0])
    for k in range(1, values.shape[1]):  # fifty times faster than a maximum along short rows
        np.maximum(size, np.abs(values[:, k]), out=size)
    return size


GROUPS: dict[str, MetricGroup] = {}
"""By name, in the order of reports; `space_robot.analysis.measure` imports all."""

SeriesSource = Callable[[AnalysedLog], TimeSeries | None]
MetricsFunction = Callable[[AnalysedLog], dict[str, float]]


def series(
    title: str,
    quantities: Mapping[str, Definition],
    derived: Mapping[str, Definition] | None = None,
) -> Callable[[SeriesSource], SeriesGroup]:
    """Register a function from a flight to its `TimeSeries`; None: it is not of this flight.

    Args:
        title: of the metrics in reports.
        quantities: by name or pattern of a column; the first that fits holds.
        derived: what `TimeSeries.derive` returns, by the metrics' names.
    """

    def register(source: SeriesSource) -> SeriesGroup:
        group = SeriesGroup(source.__name__, title, quantities, source, derived or {})
        GROUPS[group.name] = group
        return group

    return register


def metrics(
    title: str,
    quantities: Mapping[str, Definition],
    applies: Callable[[AnalysedLog], bool] = lambda flight: True,
    is_shown: bool = True,
) -> Callable[[MetricsFunction], FunctionGroup]:
    """Register a function from a flight to some of its metrics.

    Args:
        title: of the metrics in reports.
        quantities: by the metrics' names, in which ``{joint}`` stands for each joint, see `expand`.
        applies: whether a flight has them; where it should and cannot, the function raises.
        is_shown: whether tables of reports have any of them.
    """
    shown = {name: q._replace(is_shown=q.is_shown and is_shown) for name, q in quantities.items()}

    def register(function: MetricsFunction) -> FunctionGroup:
        group = FunctionGroup(function.__name__, title, shown, function, applies)
        GROUPS[group.name] = group
        return group

    return register


def pattern(template: str) -> str:
    """Return the pattern that the names of a template match."""
    return PLACEHOLDER.sub("*", template)


def expand(template: str, flight: AnalysedLog) -> list[str]:
    """Fill the place of a template in with the names that a flight has for it."""
    place = PLACEHOLDER.search(template)
    if place is None:
        return [template]
    return [template.replace(place[0], name) for name in flight.parts(place[1])]
