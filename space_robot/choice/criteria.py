"""What a choice of laws is for: the numbers of a flight that count, in one value."""

from __future__ import annotations

import math
from collections.abc import Callable
from fnmatch import fnmatchcase
from operator import itemgetter
from typing import NamedTuple

from space_robot_msgs_py.bag.flight_log import FlightLog

from ..analysis.analysed_log import AnalysedLog
from ..analysis.measure import evaluate, names
from ..analysis.words import Metrics


class Criterion(NamedTuple):
    """What a law is chosen for; of two flights the one with the smaller value is better."""

    text: str
    """As in "least ..."."""
    value: Callable[[Metrics], float]
    error: Callable[[Metrics], float]
    """What the fronts show, which the value may differ from."""
    metrics: tuple[str, ...] = ()
    """Metrics that it needs beside `METRICS`."""
    near: float = math.inf
    """Only laws count whose median error is within this factor of the least."""

    def of(self, log: FlightLog) -> dict[str, float]:
        """Return the metrics of a complete flight that scores, reasons and this one need."""
        flight, patterns = AnalysedLog(log), (*METRICS, *self.metrics)
        known = [n for n in names(flight) if any(fnmatchcase(n, p) for p in patterns)]
        return evaluate(flight, known)[0]


def mean_error(metrics: Metrics) -> float:
    """Return the geometric mean of the RMS errors of attitude and of each group of joints."""
    errors = [value for name, value in metrics.items() if is_error(name)]
    return math.exp(sum(math.log(max(error, 1e-300)) for error in errors) / len(errors))


def is_error(name: str) -> bool:
    """Return True for the RMS error of the attitude or of a group of joints."""
    return name.endswith(".rms") and name.startswith(("attitude_angle.", "joints_"))


_attitude, _tool = itemgetter("attitude_angle.rms"), itemgetter("tool_position.rms")
CRITERIA = {
    "tracking": Criterion(
        "geometric mean of the RMS errors of attitude and joints", mean_error, mean_error
    ),
    "pointing": Criterion("RMS error of the attitude", _attitude, _attitude),
    "tool": Criterion("RMS error of the tool's position", _tool, _tool, ("tool_position.rms",)),
    "wheels": Criterion(
        "motion of the base's torque up and down, which wears wheels, among laws with at most "
        "three times the least tracking error",
        itemgetter("base_torque.variation"),
        mean_error,
        ("base_torque.variation",),
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
