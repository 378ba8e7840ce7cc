"""Columns of a campaign's table that a report evaluates, with headings and units."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from space_robot_msgs_py.config.validation import one_of

from ...analysis.figures.overlay import words
from ...analysis.metrics import unit_of
from ..row.columns import ANGLE
from ..verdicts.values import metrics_of

if TYPE_CHECKING:
    from pandas import DataFrame

    from ..study import Requirement

ERRORS = ("attitude", "joints")
RIPPLE, FAST = "ripple_", "fast_ripple_"
SUFFIXES = {"_rms": "RMS", "_max": "largest"}


class Quantity(NamedTuple):
    """A numeric column; smaller is better unless a requirement says otherwise."""

    column: str
    """Name of the column, such as ``metric.attitude_rms`` or ``require.pointing``."""
    heading: str
    unit: str
    requirement: Requirement | None = None

    @property
    def name(self) -> str:
        """Return the name of the metric or requirement."""
        return self.column.partition(".")[2]

    @property
    def label(self) -> str:
        """Return heading and unit, for an axis."""
        return f"{self.heading} ({self.unit})" if self.unit else self.heading

    @property
    def sign(self) -> float:
        """Return 1 if larger is worse, -1 if smaller is."""
        return self.requirement.sign if self.requirement else 1.0

    @property
    def limit(self) -> float | None:
        """Return the requirement's limit; None for a metric."""
        return self.requirement.bound if self.requirement else None


def of_metric(name: str) -> Quantity:
    """Return the quantity of a metric."""
    for prefix, word in ((FAST, "ripple above 25 Hz"), (RIPPLE, "ripple")):
        if name.startswith(prefix):
            column = name.removeprefix(prefix)
            return Quantity(f"metric.{name}", f"{word}, {words(column)}", _unit(column))
    for suffix, word in SUFFIXES.items():
        if name.endswith(suffix):
            column = name.removesuffix(suffix)
            return Quantity(f"metric.{name}", f"{words(column)}, {word}", _unit(column))
    return Quantity(f"metric.{name}", name.replace("_", " "), "")


def of_requirement(name: str, requirement: Requirement) -> Quantity:
    """Return the quantity of a requirement: its metric within its window."""
    metric = of_metric(requirement.metric)
    window = ""
    if requirement.from_s or requirement.to_s is not None:
        to = "" if requirement.to_s is None else f" to {requirement.to_s:g} s"
        window = f", from {requirement.from_s:g} s{to}"
    return Quantity(f"require.{name}", f"{metric.heading}{window}", metric.unit, requirement)


def chosen(
    table: DataFrame,
    require: Mapping[str, Requirement],
    asked: Sequence[str] = (),
    own: Collection[str] = (),
) -> list[Quantity]:
    """Return the metrics to compare laws by: the requested ones, else the default ones.

    Defaults are RMS errors, the ripple of the base's torque, the user's own metrics, and the
    requirements.

    Args:
        table: rows of a campaign.
        require: its requirements by name.
        asked: names of requested metrics.
        own: names of the user's own metrics.

    Raises:
        InputError: there is no such metric.
    """
    known = [c.removeprefix("metric.") for c in map(str, table) if c.startswith("metric.")]
    if asked:
        return [of_metric(one_of(name, known, "metric")) for name in dict.fromkeys(asked)]
    there = metrics_of(table)
    usual = [name for name in there if name.startswith(ERRORS) and name.endswith("_rms")]
    if f"{ANGLE}_rms" in usual:
        usual.remove("attitude_rms")
        usual.insert(0, usual.pop(usual.index(f"{ANGLE}_rms")))
    usual += [name for name in there if name == f"{RIPPLE}base_torque"]
    usual += [name for name in own if name in there]
    usual += [r.metric for r in require.values() if r.metric in there]
    return [of_metric(name) for name in dict.fromkeys(usual or there[:4])]


def _unit(column: str) -> str:
    try:
        return unit_of(column).strip("-")
    except StopIteration:
        return ""
