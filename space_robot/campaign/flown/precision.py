"""Stopping rule of a campaign: stop when the share of every requirement is precise enough."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from ..row.row import Row
from ..study import Requirement, Study
from ..verdicts.share_test import Sequential

CHECKED_EVERY = 50
"""Draws between two checks. A draw is flown by every law at every grid point. The checks are at
fixed numbers of draws, so that the end does not depend on the workers or on interruptions.
"""


class Precision:
    """Counts the runs that met each requirement, and computes the number of runs to stop at.

    The required precision must be reached for every law and every grid point.
    """

    def __init__(self, study: Study, runs: int, grid: Mapping[str, int]) -> None:
        """Start without rows.

        Args:
            study: the campaign's file.
            runs: of the whole campaign.
            grid: number of values of each grid variable.
        """
        self._require, self._until = study.require, study.until
        self._number = {law: number for number, law in enumerate(study.laws)}
        self._points = math.prod(grid.values())
        laws, demands = len(study.laws), len(study.require)
        self._flown = np.zeros((runs, laws), bool)
        self._met = np.zeros((runs, laws, demands), bool)
        self._counts = np.zeros((self._points, laws, demands), np.int64)
        self._whole = 0
        """Number of consecutive runs, from the first, that all laws have flown."""
        self.stop = runs
        """Number of runs in the table; later ones are dropped."""
        self.is_reached = False

    def add(self, row: Row) -> None:
        """Add a row; the order of calls does not matter."""
        if self._until is None or self.is_reached or row.task.run >= len(self._flown):
            return
        run, law = row.task.run, self._number[row.task.law]
        self._flown[run, law] = True
        self._met[run, law] = [is_met(row, self._require, name) for name in self._require]
        while not self.is_reached and self._whole < self.stop and self._flown[self._whole].all():
            self._counts[self._whole % self._points] += self._met[self._whole]
            self._whole += 1
            if self._whole % (CHECKED_EVERY * self._points) == 0 and self._is_narrow():
                self.stop, self.is_reached = self._whole, True

    def _is_narrow(self) -> bool:
        assert self._until is not None
        half_width, draws = self._until.half_width, self._whole // self._points
        return all(
            is_narrow(self._require[name], draws - int(met), draws, half_width)
            for name, counts in zip(self._require, np.moveaxis(self._counts, -1, 0), strict=True)
            for met in counts.flat
        )


def is_narrow(demand: Requirement, failures: int, runs: int, half_width: float) -> bool:
    """Return True if the half-width of the share's interval is at most ``half_width``."""
    test = Sequential(demand.share, demand.confidence)
    return test.interval(failures, runs).half_width <= half_width


def is_met(row: Row, require: dict[str, Requirement], name: str) -> bool:
    """Return True if a row meets a requirement; False if its flight ended early."""
    value = row.require.get(name)
    return row.is_complete and value is not None and require[name].is_met(value)
