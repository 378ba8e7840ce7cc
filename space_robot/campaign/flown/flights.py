"""Execution of the flights of a campaign that are not in its store yet."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from typing import NamedTuple

import numpy as np

from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.config.text import one_line_of

from ...flight.ending import FAILED
from ...processes.executor import OutOfTimeError, WorkerDiedError, run_many
from ..row.fly import BatchFlyer, RowFlyer
from ..row.row import KILLED, OUT_OF_TIME, Row, Task
from ..store.store import CampaignStore
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
    """Batches of tasks of one law; iteration may go on after its end."""

    def __init__(self, tasks: Iterator[Task], size: int) -> None:
        """Take up to ``size`` tasks into a batch."""
        self._tasks, self._size = tasks, size
        self._waiting: dict[str, list[Task]] = {}
        self._single: deque[Task] = deque()

    def repeat_singly(self, batch: Sequence[Task]) -> None:
        """Return the tasks of a batch again, one by one."""
        self._single.extend(batch)

    def __next__(self) -> tuple[Task, ...]:
        """Return the next batch."""
        if self._single:
            return (self._single.popleft(),)
        for task in self._tasks:
            batch = self._waiting.setdefault(task.law, [])
            batch.append(task)
            if len(batch) == self._size:
                return tuple(self._waiting.pop(task.law))
        if self._waiting:
            return tuple(self._waiting.pop(next(iter(self._waiting))))
        raise StopIteration


class Flights:
    """The flights of a campaign."""

    def __init__(self, flyer: RowFlyer, runs: int, store: CampaignStore) -> None:
        """Count the rows of the store.

        Args:
            flyer: of the campaign's tasks.
            runs: of the campaign.
            store: open for writing.
        """
        self._flyer, self._runs, self._store = flyer, runs, store
        self._laws = flyer.study.laws
        self._done = np.zeros((runs, len(self._laws)), bool)
        self._failed = 0
        self.precision = Precision(flyer.study, runs, flyer.draws.grid)
        for row in store.rows():
            if row.is_final:  # results that may depend on the machine are flown again
                self._count(row)
        self.kept = int(self._done.sum())
        """Number of flights that were in the store."""

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

    def fly(
        self,
        on_progress: Callable[[Progress], object],
        workers: int,
        scheduler: str | None,
        timeout_s: float | None,
    ) -> None:
        """Fly the missing flights; each row is stored at once.

        Args:
            on_progress: called at the beginning and after every batch of flights.
            workers: see `run_many`.
            scheduler: see `run_many`.
            timeout_s: longest time of a flight; flights with one are flown one by one.

        Raises:
            InputError: the store cannot be written, or the scheduler does not answer.
        """
        batches = TaskBatches(self.missing(), WIDTH if timeout_s is None else 1)
        died: set[Task] = set()
        running = run_many(
            BatchFlyer(self._flyer),
            batches,
            workers=workers,
            scheduler=scheduler,
            timeout_s=timeout_s,
        )
        with closing(running):
            on_progress(self._progress)
            for done in running:
                rows, first = done.result, done.item[0]
                if rows is None and len(done.item) > 1:
                    batches.repeat_singly(done.item)  # only the one to blame gets no result
                    continue
                if isinstance(done.error, WorkerDiedError) and first not in died:
                    died.add(first)  # once more: whoever killed it may have meant something else
                    batches.repeat_singly([first])
                    continue
                for row in rows or [self._without_result(first, done.error)]:
                    self._store.add(row)
                    self._count(row)
                on_progress(self._progress)
                if self.precision.is_reached and self.are_complete:
                    return

    def _without_result(self, task: Task, error: Exception | None) -> Row:
        vary = self._flyer.draws.values(task.run)
        if isinstance(error, WorkerDiedError):
            return Row(task, KILLED, f"{error} twice", vary=vary)
        if isinstance(error, OutOfTimeError):
            return Row(task, OUT_OF_TIME, str(error), vary=vary)
        assert error is not None
        return Row(task, FAILED, one_line_of(error), vary=vary).digested()

    def _count(self, row: Row) -> None:
        self.precision.add(row)
        self._done[row.task.run, self._laws.index(row.task.law)] = True
        self._failed += not row.is_complete

    @property
    def _progress(self) -> Progress:
        stop = self.precision.stop
        done, total = int(self._done[:stop].sum()), stop * len(self._laws)
        return Progress(done, total, min(self.kept, total), self._failed)
