"""Requirements: met, not met or undecided, by order statistics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from .design import grid_names, independent_rows
from .order_statistics import Outlook, bound_rank, is_met, is_missed, outlook, runs_needed
from .shares import Interval, share_limits
from .values import NOT_OF_THE_LAW, ended, laws_of, measured, of_law, parts, turned

if TYPE_CHECKING:
    from pandas import DataFrame

    from ..study import Requirement, Study

Array = NDArray[np.float64]
Word = Literal["met", "not met", "undecided"]


@dataclass(frozen=True)
class Verdict:
    """What the runs of a law say about a requirement."""

    requirement: str
    law: str
    point: str
    """Of the campaign's grid; empty if it has none."""
    word: Word
    runs: int
    failures: int
    """Runs that miss the requirement, those that did not come to their end among them."""
    not_ended: int
    """Of the failures: flights that did not come to their end."""
    not_of_the_law: int
    """Of those: killed, out of time or refused."""
    limits: Interval
    """The share of cases that meet it is at least and at most this: each at the confidence."""
    bound: float | None
    """The metric is no worse than this in the demanded share of the cases, at the confidence.

    Infinite: too many flights failed. None: there are too few runs to say.
    """
    needed_without_failure: int | None
    """Further runs that would show it met if none of them failed."""
    outlook: Outlook | None
    """When it would be decided if failures go on as they did; None if it is, or cannot be said."""

    @property
    def share(self) -> float:
        """The share of the runs that met it; NaN of no runs."""
        return 1.0 - self.failures / self.runs if self.runs else float("nan")


def verdicts(table: DataFrame, study: Study) -> list[Verdict]:
    """Judge every law by every requirement, at every point of the grid.

    Args:
        table: rows of the campaign; ``require.<name>`` are the requirements' columns.
        study: its file.
    """
    rows = independent_rows(table, study.design)
    return [
        verdict(name, demand, of_law(part.table, law), law, part.point)
        for name, demand in study.require.items()
        for part in parts(rows, grid_names(table, study.vary))
        for law in laws_of(part.table)
    ]


def verdict(
    name: str, demand: Requirement, rows: DataFrame, law: str = "", point: str = ""
) -> Verdict:
    """Judge the rows of one law by one requirement.

    Args:
        name: of the requirement.
        demand: what it asks for.
        rows: one a run.
        law: for the verdict.
        point: for the verdict.
    """
    sign, column = demand.sign, f"require.{name}"
    badness = measured(turned(rows, column, sign), column)
    runs, failures = len(badness), int(np.sum(~(badness < sign * demand.bound)))
    share, confidence = demand.share, demand.confidence
    word: Word = "undecided"
    if runs and is_met(failures, runs, share, confidence):
        word = "met"
    elif runs and is_missed(failures, runs, share, confidence):
        word = "not met"
    needed = runs_needed(failures, share, confidence)
    rank = bound_rank(runs, share, confidence) if runs else None
    bound = None if rank is None else sign * float(np.sort(badness)[rank - 1])
    return Verdict(
        name, law, point, word, runs, failures,
        int(np.sum(~ended(rows))), int(rows["outcome"].isin(NOT_OF_THE_LAW).sum()),
        share_limits(runs - failures, runs, confidence), bound,
        None if needed is None else max(0, needed - runs),
        outlook(failures, runs, share, confidence) if runs and word == "undecided" else None,
    )  # fmt: skip
