"""Columns of a campaign's table that a report evaluates, with headings and units."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from space_robot_msgs_py.config.validation import one_of

from ...analysis.measure import describe, label
from ..verdicts.values import metrics_of

if TYPE_CHECKING:
    from pandas import DataFrame

    from ..study import Requirement

ERRORS = ("attitude", "joints")
"""Beginnings of the columns of errors by which laws are compared."""


class Quantity(NamedTuple):
    """A numeric column; smaller is better unless a requirement says otherwise."""

    column: str
    """Name of the column, such as ``metric.attitude_angle.rms`` or ``require.pointing``."""
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
    unit = describe(name).unit
    return Quantity(f"metric.{name}", label(name), "" if unit == "share" else unit.strip("-"))


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
    usual = [name for name in there if name.startswith(ERRORS) and name.endswith(".rms")]
    if "attitude_angle.rms" in usual:
        usual = [name for name in usual if name != "attitude.rms"]
        usual.sort(key=lambda name: name != "attitude_angle.rms")
    usual += [name for name in there if name == "base_torque.ripple"]
    usual += [name for name in own if name in there]
    usual += [r.metric for r in require.values() if r.metric in there]
    return [of_metric(name) for name in dict.fromkeys(usual or there[:4])]
