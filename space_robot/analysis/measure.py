"""All metrics of a flight: their names, units and meanings, and their numbers in one dictionary.

A new metric is a function with its declaration in one of `MODULES`, or in a module of its own that
is added there; analysis, campaigns and the reference know it then.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Container, Iterable, Iterator
from contextlib import suppress
from fnmatch import fnmatchcase
from functools import lru_cache
from importlib import import_module
from typing import NamedTuple

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError

from .analysed_log import AnalysedLog, PointingBudget
from .series import GROUPS, Definition, MetricGroup, SeriesGroup, pattern

MODULES = (
    "pointing",
    "torques",
    "actuation",
    "estimate_error",
    "tool_path",
    "momentum",
    "external_torques",
    "sizing",
)
"""Modules with metrics, in the order of reports."""
for _module in MODULES:
    import_module(f".{_module}", __package__)

STATISTIC_WORDS = {
    "rms": "RMS",
    "max": "largest",
    "rms_eq64": "RMS by (64)",
    "ripple_fast": "ripple above 25 Hz",
}


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
        start, stop = math.ceil(self.from_s / period - 1e-6), ticks
        if self.to_s is not None:
            stop = math.floor(self.to_s / period + 1e-6) + 1
        return range(min(max(start, 0), ticks), min(max(stop, 0), ticks))


def measure(
    log: FlightLog,
    wanted: Collection[str] | None = None,
    window: Window | None = None,
    budget: PointingBudget | None = None,
) -> dict[str, float]:
    """Return the metrics of a flight by name; those that it does not have are missing.

        measure(log, ["joints_1_3.rms", "base_torque.ripple"], Window(5.0))

    Args:
        log: a flight without gaps.
        wanted: names of metrics (None: all); only what they need is computed.
        window: of the flight (None: all of it). What counts from the flight's start still does.
        budget: of the base's pointing; None: the default.

    Raises:
        InputError: there is no such metric.
    """
    return evaluate(AnalysedLog(log, budget), wanted, window)[0]


def evaluate(
    flight: AnalysedLog,
    wanted: Collection[str] | None = None,
    window: Window | None = None,
    groups: Container[str] = GROUPS,
) -> tuple[dict[str, float], dict[str, str]]:
    """Return metrics as `measure` does, and why there are none, by name of the group.

    ``groups``: names of the groups to compute, where no metrics are ``wanted``.
    """
    first, rows = flight.log.first_tick, range(flight.log.ticks)
    if window:
        ticks = window.ticks(first + flight.log.ticks, flight.period)
        rows = range(max(ticks.start - first, 0), max(ticks.stop - first, 0))
    if not rows:
        return {}, {}
    numbers: dict[str, float] = {}
    unavailable: dict[str, str] = {}
    for group in _wanted_groups(wanted, groups):
        try:
            numbers |= group.evaluate(flight, rows)
        except InputError as error:
            unavailable[group.name] = str(error)
    if wanted is not None:
        numbers = {name: numbers[name] for name in wanted if name in numbers}
    return numbers, unavailable


def _wanted_groups(
    wanted: Collection[str] | None, groups: Container[str]
) -> Collection[MetricGroup]:
    if wanted is None:
        return [group for name, group in GROUPS.items() if name in groups]
    chosen = {}
    for name in wanted:
        if (group := metric_group(name)) is None:
            one_of(name, [template for _, template, _ in all_metrics()], "metric")
        else:
            chosen[group.name] = group
    return chosen.values()


def names(flight: AnalysedLog, groups: Iterable[str] | None = None) -> Iterator[str]:
    """Yield the names of the metrics that a flight has; it need not have been flown.

    ``groups``: names of the groups to look in (None: all).
    """
    for name in GROUPS if groups is None else groups:
        try:
            yield from GROUPS[name].names(flight)
        except InputError:
            continue


def all_metrics() -> Iterator[tuple[MetricGroup, str, Definition]]:
    """Yield group, pattern, unit and meaning of each metric."""
    for group in GROUPS.values():
        for name, quantity in group.describe():
            yield group, name, quantity


@lru_cache(maxsize=4096)
def _registered(name: str) -> tuple[MetricGroup | None, Definition]:
    for group, template, quantity in all_metrics():
        if fnmatchcase(name, pattern(template)):
            unit = quantity.unit.replace("{unit}", column_definition(name).unit)
            return group, quantity._replace(unit=unit)
    return None, Definition("", "")


def metric_group(name: str) -> MetricGroup | None:
    """Return the group of a metric; None: there is none, as of a user's own."""
    return _registered(name)[0]


def describe(name: str) -> Definition:
    """Return unit and meaning of a metric; of an unknown one, such as a user's own, none."""
    return _registered(name)[1]


@lru_cache(maxsize=4096)
def column_definition(name: str) -> Definition:
    """Return unit and meaning of a column, or of the column of a metric; of none it is empty."""
    own = name.rpartition(".")[0] or name
    for group in GROUPS.values():
        if isinstance(group, SeriesGroup):
            with suppress(StopIteration):
                return group.quantity(own)
    return Definition("", "")


def column_label(column: str) -> str:
    """Return the label of a column: "joints 1-3" for ``joints_1_3``."""
    word, _, axes = column.rpartition("_")
    word, _, first = word.rpartition("_")
    if axes.isdigit() and first.isdigit():
        return f"{word} {first}-{axes}".replace("_", " ")
    return column.replace("_", " ")


def label(name: str) -> str:
    """Return the label of a metric: "joints 1-3, RMS" for ``joints_1_3.rms``."""
    column, dot, statistic = name.rpartition(".")
    if not dot:
        return column_label(name)
    return f"{column_label(column)}, {STATISTIC_WORDS.get(statistic, statistic.replace('_', ' '))}"
