"""What a choice of laws is for: the numbers of a flight that count, in one value."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from fnmatch import fnmatchcase
from operator import itemgetter
from typing import Any, NamedTuple

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..analysis.analysed_log import AnalysedLog
from ..analysis.measure import evaluate, metric_group, names
from ..analysis.words import Metrics


class Criterion(NamedTuple):
    """What a law is chosen for; of two flights the one with the smaller value is better."""

    text: str
    """As in "least ..."."""
    value: Callable[[Metrics], float]
    errors: tuple[str, ...] = ("attitude_angle.rms", "joints_*.rms")
    """Patterns of the errors that the fronts show, which the value may differ from."""
    metrics: tuple[str, ...] = ()
    """Metrics that it needs beside `METRICS`."""
    near: float = math.inf
    """Only laws count whose median error is within this factor of the least."""

    def check(self, flight: AnalysedLog) -> None:
        """Raise `InputError` if a flight lacks numbers that count."""
        known = self._known(flight)
        for needed in (*self.errors, *self.metrics):
            if not any(fnmatchcase(name, needed) for name in known):
                raise InputError(f"least {self.text}: this flight has no {needed}")

    def of(self, log: FlightLog) -> dict[str, float]:
        """Return the metrics of a complete flight that scores, reasons and this one need."""
        flight = AnalysedLog(log)
        return evaluate(flight, self._known(flight))[0]

    def _known(self, flight: AnalysedLog) -> list[str]:
        patterns = (*METRICS, *self.errors, *self.metrics)
        groups = dict.fromkeys(group.name for p in patterns if (group := metric_group(p)))
        return [n for n in names(flight, groups) if any(fnmatchcase(n, p) for p in patterns)]

    def log_errors(self, metrics: Metrics) -> dict[str, float]:
        """Return the logarithm of each error that counts."""
        return {
            name: math.log(max(value, 1e-300))
            for name, value in metrics.items()
            if any(fnmatchcase(name, pattern) for pattern in self.errors)
        }

    def error(self, metrics: Metrics) -> float:
        """Return the geometric mean of the errors, see `mean_log`."""
        return math.exp(mean_log(self.log_errors(metrics)))


def mean_log(logs: Mapping[str, Any]) -> Any:
    """Return the mean of logarithms: attitude, and all groups of joints together, count alike."""
    joints = [value for name, value in logs.items() if name.startswith("joints_")]
    others = [value for name, value in logs.items() if not name.startswith("joints_")]
    kinds = [*others, sum(joints) / len(joints)] if joints else others
    return sum(kinds) / len(kinds)


def is_error(name: str) -> bool:
    """Return True for the RMS error of the attitude or of a group of joints."""
    return name.endswith(".rms") and name.startswith(("attitude_angle.", "joints_"))


def _tracking(metrics: Metrics) -> float:
    return CRITERIA["tracking"].error(metrics)


_attitude, _tool = "attitude_angle.rms", "tool_position.rms"
CRITERIA = {
    "tracking": Criterion("geometric mean of the RMS errors of attitude and joints", _tracking),
    "pointing": Criterion("RMS error of the attitude", itemgetter(_attitude), (_attitude,)),
    "tool": Criterion("RMS error of the tool's position", itemgetter(_tool), (_tool,)),
    "wheels": Criterion(
        "motion of the base's torque up and down, which wears wheels, among laws with at most "
        "three times the least tracking error",
        itemgetter("base_torque.variation"),
        metrics=("base_torque.variation",),
        near=3.0,
    ),
}
"""Criteria by name."""
METRICS = (
    *("attitude_angle.rms", "joints_*.rms", "*.ripple", "*.ripple_peak", "*.ripple_peak_hz"),
    *("*.ripple_lasting", "base_torque.rms", "torque_*.rms", "force_prismatic.rms"),
    *("wheels.saturation", "*.standing", "*.beyond_effort"),
)
"""Patterns of the metrics that scores and reasons need."""
