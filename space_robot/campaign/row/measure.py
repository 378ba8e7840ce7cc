"""The numbers of a flight's row: its metrics, those that are required, and bands over time."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from fnmatch import fnmatchcase
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import FlightLog, MeasuredStates
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError

from ...analysis.analysed_log import AnalysedLog, PointingBudget
from ...analysis.measure import Window, evaluate, metric_group, names
from ...analysis.own_metric import OwnMetric
from ...analysis.pointing import lacking_for_jitter
from ...analysis.series import GROUPS, SeriesGroup
from ...analysis.tool_path import leads_tool
from ...analysis.torques import lacking_for_ripple
from ...analysis.words import WARNING_GROUPS, warnings
from ...flight.flown_log import empty_log
from ...flight.plan import Flight
from ..study import Condition, Requirement

COLUMNS = (
    *("attitude_angle", "attitude", "joints_*", "base_torque", "force_prismatic", "torque_*"),
    *("attitude_drift", "tool", "tool_rotation", "half_cone", "about_axis"),
)
"""Columns of series whose RMS and maximum every row has, and their bands over time."""
SERIES = ("errors", "torques", "drift", "tool")
"""The series with these columns; the last one is of missions that lead the tool."""
FURTHER = (
    *(f"{torque}.{key}" for key in ("ripple", "ripple_fast") for torque in COLUMNS[3:6]),
    "half_cone.outside_band",
    *(f"{angle}.jitter_{key}" for angle in COLUMNS[-2:] for key in ("rms", "max")),
    "*.settling",
    "wheels.saturation",
    "torque_limits.share",
)
"""Further metrics of every row, as far as a flight has them."""
FURTHER_GROUPS = ("steadiness", "ripple", "settling", "wheel_saturation", "saturation")
"""The groups with these metrics. Every row also has the whole group ``standing``."""
MESSAGE_GROUPS = ("navigation", "saturation", "latency", "commands", "estimate_error")
"""Groups that need more of a flight than its true states: measurements, commands."""
BINS = 100
"""Bins of a band; a flight with fewer ticks has one bin per tick."""


class Measured(NamedTuple):
    """The numbers of a flight."""

    metrics: dict[str, float]
    require: dict[str, float]
    """The metric of each requirement in its window, by the requirement's name."""
    bands: dict[str, NDArray[np.float32]]
    warnings: str
    """See `Row`."""


def planned(flight: Flight, budget: PointingBudget | None = None) -> AnalysedLog:
    """Return a flight before it is flown, for the names of its metrics: only its mission is known.

    ``budget``: of the base's pointing; None: the default.
    """

    def allocate(shape: tuple[int, ...]) -> Array:
        return np.broadcast_to(np.nan, shape)  # takes no memory

    log = empty_log(flight, allocate=allocate, is_brief=True)
    if not flight.plant.measures_truth:
        log.measured = MeasuredStates.unknown(log, allocate)
    return AnalysedLog(log, budget)


def row_metrics(flight: AnalysedLog, require: Iterable[Requirement] = ()) -> list[str]:
    """Return the metrics that the row of a flight has: the usual ones, and those required."""
    columns = row_columns(flight)
    known = list(names(flight, FURTHER_GROUPS))
    usual = [f"{column}.{statistic}" for statistic in ("rms", "max") for column in columns]
    for template in FURTHER:
        usual += [name for name in known if fnmatchcase(name, template)]
    usual += GROUPS["standing"].evaluate(flight, range(flight.log.ticks))  # of joints that move
    asked = [demand.metric for demand in require if demand.window == Window()]
    return list(dict.fromkeys([*usual, *asked]))


def needs_truth_only(flights: Iterable[Flight], require: Iterable[Requirement]) -> bool:
    """Return True if logs of the true states alone have all metrics of the flights' rows."""
    plants = [flight.plant_settings for flight in flights]
    if any(plant.base_torque_limit or plant.joint_torque_limit for plant in plants):
        return False
    groups = (metric_group(demand.metric) for demand in require)
    return not any(group and group.name in MESSAGE_GROUPS for group in groups)


def row_columns(flight: AnalysedLog) -> list[str]:
    """Return the columns of a row's bands."""
    known = [name.rpartition(".")[0] for name in names(flight, _series(flight))]
    matching = (name for pattern in COLUMNS for name in known if fnmatchcase(name, pattern))
    return list(dict.fromkeys(matching))


def _series(flight: AnalysedLog) -> tuple[str, ...]:
    return SERIES if leads_tool(flight.log) else SERIES[:-1]


def measure_row(
    log: FlightLog,
    ticks: int,
    require: Mapping[str, Requirement],
    own: Collection[OwnMetric] = (),
    budget: PointingBudget | None = None,
) -> Measured:
    """Return the numbers of a complete flight, with metrics of the user's ``own``.

    ``ticks``: of the flight as it was planned; ``budget`` None: the default.

    Raises:
        MetricError: an own metric's function raised an error, or returned no number.
    """
    flight = AnalysedLog(log, budget)
    columns, own_by_name = row_columns(flight), {metric.name: metric for metric in own}
    wanted = [m for m in row_metrics(flight, require.values()) if m not in own_by_name]
    groups = {*WARNING_GROUPS, *(group.name for m in wanted if (group := metric_group(m)))}
    known = evaluate(flight, groups=groups)[0]
    metrics = {name: known[name] for name in wanted if name in known}
    metrics |= {metric.name: metric.value(log) for metric in own}
    values = {}
    for name, demand in require.items():
        window, metric = demand.window, demand.metric
        if window == Window():
            values[name] = metrics.get(metric, np.nan)
        elif metric in own_by_name:
            rows = window.ticks(log.ticks, log.timebase.period)
            values[name] = own_by_name[metric].value(log.rows(rows.start, rows.stop))
        else:
            values[name] = evaluate(flight, [metric], window)[0].get(metric, np.nan)
    blocks = [
        (start, {column: size for column, size in sizes.items() if column in columns})
        for group in map(GROUPS.__getitem__, _series(flight))
        if isinstance(group, SeriesGroup)
        for start, sizes in group.sizes(flight)
    ]
    bands = largest_in_bins(blocks, ticks)
    warned = "; ".join(text.partition(":")[0] for text in warnings(known))
    own_bands = {name: bands[name] for name in columns}
    return Measured(_finite(metrics), _finite(values), own_bands, warned)


def check_requirements(
    flight: Flight,
    require: Mapping[str, Condition],
    where: str,
    context: str = "",
    own: Collection[str] = (),
    budget: PointingBudget | None = None,
) -> None:
    """Check that a flight has the metrics of all requirements, or the user's ``own`` names.

    Errors name the key of the mapping, ``where``, and the difference from the nominal flight,
    ``context``.
    """
    if not require:
        return
    known, end = list(names(planned(flight, budget))), flight.ticks * flight.period
    context = context and f" ({context})"
    for name, demand in require.items():
        key = f"{where}.{name}"
        try:
            one_of(demand.metric, (*known, *own), "metric", f" in {key}.metric")
        except InputError as error:
            raise InputError(f"{error}{context}") from None
        if demand.from_s >= end:
            raise InputError(
                f"{key}.from_s: must be before the end of the flight ({end:g} s), "
                f"got {demand.from_s:g}{context}"
            )
        ticks = len(demand.window.ticks(flight.ticks, flight.period))
        if not ticks:
            raise InputError(
                f"{key}.to_s: no tick between {demand.from_s:g} and {demand.to_s:g} s, "
                f"the period is {flight.period:g} s{context}"
            )
        seconds, window_s = ticks * flight.period, (budget or PointingBudget()).window_s
        lacking = lacking_for_ripple(demand.metric, seconds, flight.period)
        lacking = lacking or lacking_for_jitter(demand.metric, seconds, window_s, flight.period)
        if lacking and demand.metric not in own:
            raise InputError(f"{key}.metric: {demand.metric} {lacking}{context}")


def _finite(values: Mapping[str, float]) -> dict[str, float]:
    return {name: value for name, value in values.items() if np.isfinite(value)}


def largest_in_bins(
    blocks: Iterable[tuple[int, Mapping[str, Array]]], ticks: int
) -> dict[str, NDArray[np.float32]]:
    """Return the largest size of each column in each bin; bin k of K begins at ``k ticks // K``.

    Args:
        blocks: first tick, and the sizes (N,) by column, of each block of a flight.
        ticks: of the whole flight, which was flown to its end.
    """
    count = min(BINS, ticks)
    starts = np.arange(count, dtype=np.int64) * ticks // count
    largest: dict[str, Array] = {}
    for first, sizes in blocks:
        for name, size in sizes.items():
            own = largest.setdefault(name, np.zeros(count))
            low = int(np.searchsorted(starts, first, side="right")) - 1
            high = int(np.searchsorted(starts, first + len(size), side="left"))
            cuts = np.maximum(starts[low:high] - first, 0)
            np.maximum(own[low:high], np.maximum.reduceat(size, cuts), out=own[low:high])
    with np.errstate(over="ignore"):
        return {name: values.astype(np.float32) for name, values in largest.items()}
