"""Statistical results of a campaign, computed once for terminal, page and JSON."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from ..flown.precision import is_narrow
from ..study import short_names
from ..verdicts.design import SALTELLI, independent_rows, saltelli_values, variables
from ..verdicts.league import League, league
from ..verdicts.requirements import Verdict, family_error, verdicts
from ..verdicts.sensitivity import Sensitivity, sensitivity
from ..verdicts.sobol import SobolIndices, sobol_indices
from ..verdicts.values import GridPoint, ended, is_known, laws_of, measured, of_law, parts, turned
from .quantities import Quantity, chosen, of_requirement
from .subject import Subject

if TYPE_CHECKING:
    from pandas import DataFrame

CONFIDENCE = 0.95
"""Confidence of all intervals and comparisons; a requirement has its own."""


class Findings:
    """Statistical results of a campaign's rows.

    Args:
        subject: the campaign.
        metrics: names of the metrics to compare laws by; empty: the default ones.

    Raises:
        InputError: there is no such metric.
    """

    def __init__(self, subject: Subject, metrics: Sequence[str] = ()) -> None:
        self.subject = subject
        study = subject.study
        self.metrics = chosen(subject.table, study.require, metrics, study.metrics)
        self.required = [of_requirement(*item) for item in subject.study.require.items()]
        self.grid = list(subject.grid)
        self.rows = independent_rows(subject.table, subject.study.design)
        """Rows of independent draws: all, except in a Saltelli design."""
        self.parts: list[GridPoint] = parts(self.rows, self.grid)
        self.laws = laws_of(subject.table)

    @cached_property
    def names(self) -> dict[str, str]:
        """Return the name of each law in tables."""
        return short_names(self.laws)

    @property
    def whole(self) -> GridPoint:
        """Return the rows of all grid points together."""
        return GridPoint((), "", self.rows)

    @cached_property
    def verdicts(self) -> list[Verdict]:
        """Return the verdict on every requirement, law and point of the grid."""
        return verdicts(self.subject.table, self.subject.study, self.subject.runs, self.grid)

    @property
    def family_error(self) -> float:
        """Return an upper bound of the probability that any verdict is false."""
        return family_error(self.subject.study, self.verdicts)

    @cached_property
    def leagues(self) -> list[tuple[GridPoint, Quantity, League]]:
        """Return the league of every metric at every point of the grid."""
        return [
            (part, metric, league(part.table, metric.column, CONFIDENCE))
            for metric in self.metrics
            for part in self.parts
            if is_known(part.table, metric.column)
        ]

    @cached_property
    def driven(self) -> list[Quantity]:
        """Return the quantities of sensitivities and worst runs: requirements, or first metric."""
        known = [q for q in self.required if q.column in self.subject.table]
        return known or self.metrics[:1]

    @cached_property
    def sensitivities(self) -> list[tuple[GridPoint, Quantity, Sensitivity]]:
        """Return the sensitivities of each quantity under each law at each grid point."""
        sensitivities = []
        for quantity in self.driven:
            for part in self.parts:
                rows = turned(part.table, quantity.column, quantity.sign)
                for law in laws_of(rows):
                    if result := sensitivity(rows, law, quantity.column, CONFIDENCE):
                        sensitivities.append((part, quantity, result))
        return sensitivities

    def worst(
        self, part: GridPoint, quantity: Quantity, count: int = 10, law: str = ""
    ) -> DataFrame:
        """Return the worst rows: failed flights, the earliest first, then by value.

        Args:
            part: the grid point.
            quantity: to sort by.
            count: maximum number of rows.
            law: rows of this law only; empty: of all.
        """
        rows = turned(part.table, quantity.column, quantity.sign)
        if law:
            rows = of_law(rows, law)
        times = rows["ended_at_s"].to_numpy(np.float64, na_value=0.0)
        values = measured(rows, quantity.column)
        values[np.isinf(values) & ended(rows)] = -np.inf  # not measured: sorted last
        order = np.lexsort((rows["run"], times, -values))
        return part.table.loc[rows.index[order[:count]]]

    @cached_property
    def sobol(self) -> list[SobolIndices]:
        """Return Sobol indices of each quantity under each law; empty for other designs."""
        table = self.subject.table
        if self.subject.study.design != SALTELLI:
            return []
        indices = [
            sobol_indices(
                saltelli_values(table, law, metric.column),
                variables(table),
                law,
                metric.heading,
                CONFIDENCE,
            )
            for metric in self.metrics
            for law in self.laws
        ]
        return [each for each in indices if each]

    @property
    def _is_precise(self) -> bool:
        """Return True if the campaign stopped at the precision required by its file."""
        study = self.subject.study
        return study.until is not None and all(
            is_narrow(study.require[v.requirement], v.runs - v.met, v.runs, study.until.half_width)
            for v in self.verdicts
        )

    @property
    def remarks(self) -> list[str]:
        """Return remarks on the validity of the rows, one sentence each."""
        subject, table = self.subject, self.subject.table
        remarks, asked = [*subject.remarks], subject.runs * len(subject.study.laws)
        if len(table) < asked and not self._is_precise:
            remarks.append(
                f"The campaign is not finished: {len(table)} of {asked} flights have been flown; "
                "all numbers are of these."
                + " The number of runs is fixed: there are no verdicts before all are flown."
                * (subject.study.has_fixed_runs and bool(self.required))
            )
        counts = table["outcome"].value_counts()
        foreign = [f"{counts[o]} {o}" for o in ("killed", "out_of_time", "refused") if o in counts]
        if foreign:
            remarks.append(
                f"Of the flights that did not come to their end {', '.join(foreign)}: they count "
                "as failures, though the law may be without blame."
            )
        if not ended(table).any():
            remarks.append("No flight came to its end, so there are no metrics.")
        if (design := subject.study.design) != "independent":
            remarks.append(
                f"The runs are of the design {design}, not independent of one another: verdicts "
                "and intervals, which take them for independent, are approximate."
                + " They are of its points A and B."
                * (design == SALTELLI)
            )
        return remarks
