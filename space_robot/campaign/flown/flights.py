"""Execution of the flights of a campaign that are not in its journal yet."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from typing import Any, NamedTuple

import numpy as np

from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.config.text import one_line_of

from ...flight.ending import FAILED
from ...processes.pool import OutOfTimeError, WorkerDiedError, run_many
from ..row.fly import BatchFlyer, RowFlyer
from ..row.row import KILLED, OUT_OF_TIME, Row, Task
from ..store.journal import Journal
from .precision import Precision


class Progress(NamedTuple):
    """Progress of a campaign."""

    done: int
    """Number of flights that have a row."""
    total: int
    """Total number of flights."""
    kept: int
    """Number of done flights that an earlier call had flown."""
    failed: int
    """Number of done flights that ended early or were not flown."""


class TaskBatches(Iterator[tuple[Task, ...]]):
    """Tasks in groups of one law, to be flown together; it may go on after its end."""

    def __init__(self, tasks: Iterator[Task], size: int) -> None:
        """Take up to ``size`` tasks into a group."""
        self._tasks, self._size = tasks, size
        self._waiting: dict[str, list[Task]] = {}
        self._single: deque[Task] = deque()

    def split(self, batch: Sequence[Task]) -> None:
        """Give out the tasks of a group again, one by one."""
        self._single.extend(batch)

    def __next__(self) -> tuple[Task, ...]:
        """Return the next group."""
        if self._single:
            return (self._single.popleft(),)
        for task in self._tasks:
            group = self._waiting.setdefault(task.law, [])
            group.append(task)
            if len(group) == self._size:
                return tuple(self._waiting.pop(task.law))
        if self._waiting:
            return tuple(self._waiting.pop(next(iter(self._waiting))))
        raise StopIteration


class Flights:
    """The flights of a campaign."""

    def __init__(self, flyer: RowFlyer, runs: int, journal: Journal) -> None:
        """Read the rows of the journal.

        Args:
            flyer: of the campaign's tasks.
            runs: of the campaign.
            journal: open.
        """
        self._flyer, self._runs, self._journal = flyer, runs, journal
        self._laws = flyer.study.laws
        self._done = np.zeros((runs, len(self._laws)), bool)
        self._failed = 0
        self.precision = Precision(flyer.study, runs, flyer.draws.grid)
        for row in journal.rows(runs):
            if row.is_final:  # results that may depend on the machine are flown again
                self._count(row)
        self.kept = int(self._done.sum())
        """Number of flights that were in the journal."""

    @property
    def count(self) -> int:
        """Total number of flights."""
        return self.precision.stop * len(self._laws)

    def missing(self) -> Iterator[Task]:
        """Yield the missing flights, in order, until the precision is reached."""
        for run in range(self._runs):
            if run >= self.precision.stop:
                return
            for number in np.flatnonzero(~self._done[run]):
                yield Task(run, self._laws[number])

    @property
    def are_complete(self) -> bool:
        """True if no flight is missing."""
        return next(self.missing(), None) is None

    def fly(self, on_progress: Callable[[Progress], object], options: Mapping[str, Any]) -> None:
        """Fly the missing flights; each row is stored in the journal at once.

        Args:
            on_progress: called at the beginning and after every group of flights.
            options: of `run_many`.

        Raises:
            InputError: the journal cannot be written, or the scheduler does not answer.
        """
        # a time limit is that of a flight, so flights with one are flown one by one
        size = WIDTH if options.get("timeout_s") is None else 1
        tasks = TaskBatches(self.missing(), size)
        done = run_many(BatchFlyer(self._flyer), tasks, **options)
        with closing(done):
            on_progress(self._progress)
            for result in done:
                if result.result is None and len(result.item) > 1:
                    tasks.split(result.item)  # so that only the guilty flight has no row
                    continue
                for row in result.result or [self._unflown(result.item[0], result.error)]:
                    self._journal.add(row)
                    self._count(row)
                on_progress(self._progress)
                if self.precision.is_reached and self.are_complete:
                    return

    def _unflown(self, task: Task, error: Exception | None) -> Row:
        """Return the row of a flight whose process returned none."""
        vary = self._flyer.draws.values(task.run)
        if isinstance(error, (WorkerDiedError, OutOfTimeError)):
            outcome = KILLED if isinstance(error, WorkerDiedError) else OUT_OF_TIME
            return Row(task, outcome, str(error), vary=vary)
        assert error is not None
        return Row(task, FAILED, one_line_of(error), vary=vary).digested()

    def _count(self, row: Row) -> None:
        self.precision.add(row)
        self._done[row.task.run, self._laws.index(row.task.law)] = True
        self._failed += not row.is_complete

    @property
    def _progress(self) -> Progress:
        done, total = int(self._done[: self.precision.stop].sum()), self.count
        return Progress(done, total, min(self.kept, total), self._failed)
