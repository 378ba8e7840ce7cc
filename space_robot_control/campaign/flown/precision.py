"""When a campaign may stop: as soon as every requirement's share is known well enough."""

from __future__ import annotations

import numpy as np

from ..row.row import Row
from ..study import Requirement, Study
from ..verdicts.shares import share_interval

CHECKED_EVERY = 50
"""Runs between two looks. They are at fixed numbers of runs, all of them flown by every law, so
that neither workers nor kills have a say in where a campaign stops."""


class Precision:
    """Counts the runs that met each requirement, and finds the number of runs at which to stop."""

    def __init__(self, study: Study, runs: int) -> None:
        """Begin without rows; ``runs``: of the whole campaign."""
        self._require, self._until = study.require, study.until
        self._number = {law: number for number, law in enumerate(study.laws)}
        laws, demands = len(study.laws), len(study.require)
        self._flown = np.zeros((runs, laws), bool)
        self._met = np.zeros((runs, laws, demands), bool)
        self._counts = np.zeros((laws, demands), np.int64)
        self._whole = 0
        """Runs from the first on that all laws have flown."""
        self.stop = runs
        """Runs that count: those from here on are dropped."""
        self.is_reached = False

    def add(self, row: Row) -> None:
        """Take a row, in any order."""
        if self._until is None or self.is_reached or row.task.run >= len(self._flown):
            return
        run, law = row.task.run, self._number[row.task.law]
        self._flown[run, law] = True
        self._met[run, law] = [is_met(row, self._require, name) for name in self._require]
        while not self.is_reached and self._whole < self.stop and self._flown[self._whole].all():
            self._counts += self._met[self._whole]
            self._whole += 1
            if self._whole % CHECKED_EVERY == 0 and self._is_narrow():
                self.stop, self.is_reached = self._whole, True

    def _is_narrow(self) -> bool:
        assert self._until is not None
        return all(
            share_interval(int(count), self._whole, demand.confidence).half_width
            <= self._until.half_width
            for demand, counts in zip(self._require.values(), self._counts.T, strict=True)
            for count in counts
        )


def is_met(row: Row, require: dict[str, Requirement], name: str) -> bool:
    """Tell whether a row meets a requirement; one that did not come to its end meets none."""
    value = row.require.get(name)
    return row.is_complete and value is not None and require[name].is_met(value)
