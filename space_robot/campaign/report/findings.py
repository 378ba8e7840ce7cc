"""Findings of a campaign: what its rows show, computed once for terminal, page and JSON."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from typing_extensions import Self

from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import InputError

from ...analysis.measure import Window, describe, label
from ...scenario.recorded import differences
from ..flown import FlownCampaign
from ..flown.flights import is_narrow
from ..flown.flown_campaign import needs_trust
from ..study import Requirement, Study, short_names
from ..verdicts.influences import Sensitivity, SobolIndices, sensitivity, sobol_indices
from ..verdicts.laws import League, league
from ..verdicts.requirements import Verdict, family_error, verdicts
from ..verdicts.rows import (
    EXTERNAL,
    SALTELLI,
    GridPoint,
    grid_points,
    has_values,
    independent_rows,
    is_complete,
    law_rows,
    laws_in,
    penalised,
    saltelli_values,
    variables,
)

if TYPE_CHECKING:
    from pandas import DataFrame

CONFIDENCE = 0.95
"""Confidence of all intervals and comparisons; a requirement has its own."""
WORST = 10
"""Length of a list of the worst runs."""
FLOWN = ("scenario", "laws", "vary", "design")
"""Keys of a study that its flights depend on."""


class Quantity(NamedTuple):
    """A numeric column; smaller is better unless a requirement says otherwise."""

    column: str
    """Name of the column, such as ``metric.attitude_angle.rms`` or ``require.pointing``."""
    heading: str
    unit: str
    requirement: Requirement | None = None

    @classmethod
    def of(cls, metric: str, name: str = "", requirement: Requirement | None = None) -> Self:
        """Return a metric of the registry, or with ``name`` that of a requirement."""
        unit, heading = describe(metric).unit, label(metric)
        unit = "" if unit == "share" else unit.strip("-")
        if requirement is None:
            return cls(f"metric.{metric}", heading, unit)
        if requirement.from_s or requirement.to_s is not None:
            to = "" if requirement.to_s is None else f" to {requirement.to_s:g} s"
            heading += f", from {requirement.from_s:g} s{to}"
        return cls(f"require.{name}", heading, unit, requirement)

    @property
    def name(self) -> str:
        """Return the name of the metric or requirement."""
        return self.column.partition(".")[2]

    @property
    def title(self) -> str:
        """Return the name, after the identifier of the requirement if it has one."""
        id_ = self.requirement.id if self.requirement else None
        return f"{id_} {self.name}" if id_ else self.name

    @property
    def label(self) -> str:
        """Return heading and unit, for an axis."""
        return f"{self.heading} ({self.unit})" if self.unit else self.heading

    @property
    def sign(self) -> float:
        """Return 1 if larger is worse, -1 if smaller is."""
        return self.requirement.sign if self.requirement else 1.0


@dataclass
class Findings:
    """What the rows of a campaign show."""

    folder: Path
    """Path as the user wrote it, for the commands in the report."""
    study: Study
    """With the requirements to judge by."""
    seed: int
    runs: int
    """Number of requested runs."""
    table: DataFrame
    """The flown rows."""
    grid: Sequence[str] = ()
    """Names of the grid variables."""
    about: Mapping[str, str] = field(default_factory=dict)
    """Versions and digests, by name."""
    warnings: Sequence[str] = ()
    """One line for each difference from the study that was flown."""
    compared: Sequence[str] = ()
    """Names of the metrics to compare laws by; empty: the default ones."""

    @classmethod
    def of(
        cls, campaign: FlownCampaign, study: Study | None = None, compared: Sequence[str] = ()
    ) -> Self:
        """Read all rows that have been flown; ``study``: requirements to judge by instead."""
        manifest = campaign.manifest
        warnings: list[str] = []
        table = campaign.table
        if table.empty:
            raise InputError(f"{campaign.folder}: no flight has been flown yet")
        if study is not None:
            table = rejudged(study, table, campaign.study)
            warnings.append(f"The requirements are those of {study.where}.")
        elif changes := campaign.study_changes:
            warnings.append(f"{changes}; what was flown counts")
        about = {name: text for name, text in manifest.software.items() if text}
        about |= {"commit": manifest.commit} if manifest.commit else {}
        about |= {f"digest of {name}": digest[:16] for name, digest in manifest.files.items()}
        return cls(
            campaign.folder,
            study or campaign.study,
            campaign.seed,
            campaign.runs,
            table,
            list(manifest.table.grid),
            about,
            warnings,
            compared,
        )

    def __post_init__(self) -> None:
        """Choose the metrics."""
        self.laws = laws_in(self.table)
        self.names = short_names(self.laws)
        """Name of each law in tables."""
        self.rows = independent_rows(self.table, self.study.design)
        """Rows of independent draws: all, except in a Saltelli design."""
        self.whole = GridPoint((), "", self.rows)
        self.points = grid_points(self.rows, self.grid)
        self.metrics = [Quantity.of(name) for name in dict.fromkeys(self._compared())]
        self.required = [Quantity.of(r.metric, n, r) for n, r in self.study.require.items()]
        judged = [q for q in self.required if q.column in self.table]
        self.judged = judged or self.metrics[:1]
        """Quantities of influences and worst runs: requirements, or the first metric."""

    def _compared(self) -> list[str]:
        """Return the metrics to compare laws by.

        Defaults are RMS errors, the ripple of the base's torque, the user's own metrics, and the
        requirements.
        """
        columns = [c.partition(".")[2] for c in map(str, self.table) if c.startswith("metric.")]
        if self.compared:
            return [one_of(name, columns, "metric") for name in self.compared]
        known = [name for name in columns if has_values(self.table, f"metric.{name}")]
        errors = [n for n in known if n.startswith(("attitude", "joints")) and n.endswith(".rms")]
        if "attitude_angle.rms" in errors:
            errors = [n for n in errors if n not in ("attitude_angle.rms", "attitude.rms")]
            errors.insert(0, "attitude_angle.rms")
        required = (demand.metric for demand in self.study.require.values())
        others = ("base_torque.ripple", *self.study.metrics, *required)
        return [*errors, *(name for name in others if name in known)] or known[:4]

    @cached_property
    def flight_warnings(self) -> list[str]:
        """Return a sentence for each law: in how many complete flights which warning was due."""
        sentences = []
        for law, rows in self.table[is_complete(self.table)].groupby("law", sort=False):
            words = "; ".join(rows.get("warnings", ())).split("; ")
            kinds = Counter(filter(None, words)).most_common()
            counts = (f"{kind} in {count:,} of {len(rows):,}" for kind, count in kinds)
            sentences += [f"{self.names[str(law)]}: {', '.join(counts)} flights"] if kinds else []
        return sentences

    @cached_property
    def verdicts(self) -> list[Verdict]:
        """Return the verdict on every requirement, law and point of the grid."""
        return verdicts(self.table, self.study, self.runs, self.grid)

    @property
    def family_error(self) -> float:
        """Return an upper bound of the probability that any verdict is false."""
        return family_error(self.study, self.verdicts)

    @cached_property
    def leagues(self) -> list[tuple[GridPoint, Quantity, League]]:
        """Return the league of every metric at every point of the grid."""
        return [
            (point, metric, league(point.table, metric.column, CONFIDENCE))
            for metric in self.metrics
            for point in self.points
            if has_values(point.table, metric.column)
        ]

    @cached_property
    def sensitivities(self) -> list[tuple[GridPoint, Quantity, Sensitivity]]:
        """Return the sensitivities of each quantity under each law at each grid point."""
        return [
            (point, quantity, result)
            for quantity in self.judged
            for point in self.points
            for law in laws_in(point.table)
            if (result := sensitivity(point.table, law, quantity.column, CONFIDENCE, quantity.sign))
        ]

    @cached_property
    def sobol(self) -> list[SobolIndices]:
        """Return Sobol indices of each metric under each law; empty for other designs."""
        if self.study.design != SALTELLI:
            return []
        names = variables(self.table)
        each = (
            sobol_indices(
                saltelli_values(self.table, law, metric.column),
                names,
                law,
                metric.heading,
                CONFIDENCE,
            )
            for metric in self.metrics
            for law in self.laws
        )
        return [indices for indices in each if indices]

    def worst(
        self, point: GridPoint, quantity: Quantity, count: int = WORST, law: str = ""
    ) -> DataFrame:
        """Return the worst rows of a law (empty: of all): failed flights first, then by value."""
        rows = law_rows(point.table, law) if law else point.table
        times = rows["ended_at_s"].to_numpy(np.float64, na_value=0.0)
        values = penalised(rows, quantity.column, quantity.sign)
        values[np.isinf(values) & is_complete(rows)] = -np.inf  # not measured: sorted last
        return rows.iloc[np.lexsort((rows["run"], times, -values))[:count]]

    def rerun_command(self, run: int, law: str) -> str:
        """Return the command that flies a row again and records a bag."""
        words = ["space-robot", "campaign", "rerun", str(self.folder), str(run), "--law", law]
        bag = f"flights/{run}_{re.sub('[^A-Za-z0-9.-]', '_', law)}"
        trust = ["--trust"] if needs_trust(self.study) else []
        return shlex.join([*words, "--bag", bag, *trust])

    @property
    def _is_precise(self) -> bool:
        require, until = self.study.require, self.study.until
        return until is not None and all(
            is_narrow(require[v.requirement], v.runs - v.met, v.runs, until.half_width)
            for v in self.verdicts
        )

    @cached_property
    def remarks(self) -> list[str]:
        """Return remarks on the validity of the rows, one sentence each."""
        table, remarks = self.table, [*self.warnings]
        requested = self.runs * len(self.study.laws)
        if len(table) < requested and not self._is_precise:
            remarks.append(
                f"The campaign is not finished: {len(table)} of {requested} flights have been "
                "flown; all numbers are of these."
                + " The number of runs is fixed: there are no verdicts before all are flown."
                * (self.study.has_fixed_runs and bool(self.required))
            )
        counts = table["outcome"].value_counts()
        if external := [f"{counts[o]} {o}" for o in EXTERNAL if o in counts]:
            remarks.append(
                f"{', '.join(external)}: these flights count as failures, though the law may not "
                "have caused it."
            )
        if not is_complete(table).any():
            remarks.append("No flight is complete, so there are no metrics.")
        if (design := self.study.design) != "independent":
            remarks.append(
                f"The runs are of the design {design}, not independent of one another: verdicts "
                "and intervals, which assume independence, are approximate."
                + " They are of its points A and B."
                * (design == SALTELLI)
            )
        return remarks


def rejudged(study: Study, table: DataFrame, flown: Study) -> DataFrame:
    """Return the table with the requirements of another study than the one that was flown."""

    def check_same(key: str, then: Any, now: Any) -> None:
        if now != then:
            reason = f"{short(then)} was flown, not {short(now)}: fly the new study"
            raise InputError(f"{study.where}: {key}: {reason}")

    for part in FLOWN:
        for key, then, now in differences(flown.content[part], study.content[part], part):
            check_same(key, then, now)
    for name, function in study.metrics.items():
        check_same(f"metrics.{name}", flown.metrics.get(name), function)
    known = {(d.metric, d.window): f"require.{name}" for name, d in flown.require.items()}
    columns = {}
    for name, demand in study.require.items():
        metric, window = demand.metric, demand.window
        column = known.get((metric, window), f"metric.{metric}" if window == Window() else "")
        if column not in table:
            windows = (
                f"{metric} from {from_s:g} s to {'its end' if to_s is None else f'{to_s:g} s'}"
                for metric, (from_s, to_s) in known
            )
            raise InputError(
                f"{study.where}: require.{name}: the rows have no {metric} in that window; they "
                f"have {', '.join(windows)}, and the metrics of whole flights"
            )
        columns[f"require.{name}"] = table[column]
    others = [column for column in table if not str(column).startswith("require.")]
    return table[others].assign(**columns)
