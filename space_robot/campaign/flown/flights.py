"""Execution of a campaign: missing flights, the stopping rule, bags of the flights to be kept."""

from __future__ import annotations

import math
import re
import shutil
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.errors import FlightError, InputError

from ...console.files import make_folder
from ...flight.ending import DIVERGED, FAILED, UNANSWERED
from ...flight.simulate import simulate
from ...gpu.device import DeviceError
from ...gpu.fly import MOST_FLIGHTS
from ...processes.executor import OutOfTimeError, WorkerDiedError, run_many
from ..row.fly import BatchFlyer, RowFlyer
from ..row.row import KILLED, OUT_OF_TIME, Row, Task
from ..study import Requirement, Study
from ..verdicts.requirements import Sequential
from .store import BAGS, CampaignStore

CHECKED_EVERY = 50
"""Draws between two checks. A draw is flown by every law at every grid point. The checks are at
fixed numbers of draws, so that the end does not depend on the workers or on interruptions.
"""


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
        """Count the rows of a store that is open for writing."""
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
        """Fly the missing flights, see `run_many`; each row is stored at once.

        ``on_progress`` is called at the beginning and after every batch of flights; flights with a
        time limit are flown one by one.
        """
        together = MOST_FLIGHTS if self._flyer.device == "gpu" else WIDTH
        batches = TaskBatches(self.missing(), together if timeout_s is None else 1)
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
                if isinstance(done.error, DeviceError):  # it would fail for the others, too
                    raise done.error
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


class Precision:
    """Counts the runs that met each requirement, and computes the number of runs to stop at.

    The required precision must be reached for every law and every grid point.
    """

    def __init__(self, study: Study, runs: int, grid: Mapping[str, int]) -> None:
        """Start without rows; ``grid``: number of values of each grid variable."""
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


@dataclass(frozen=True)
class BagFlyer:
    """Flies a task and records its bag."""

    flyer: RowFlyer
    folder: Path
    """Folder of the bags."""

    def __call__(self, task: Task) -> None:
        """Fly a task; the bag gets its final name once it is complete."""
        unfinished = self.folder / f".{bag_name(task)}"
        flight = self.flyer.draws.flight(task.run, task.law)
        with suppress(FlightError):  # its row says so
            simulate(flight, unfinished)
        unfinished.rename(self.folder / bag_name(task))


def bag_name(task: Task) -> str:
    """Return the folder name of a task's bag, such as ``4711_tde_stc``."""
    return f"{task.run}_{re.sub(r'[^A-Za-z0-9_.=-]', '_', task.law)}"


def fly_bags(folder: Path, flyer: RowFlyer, rows: Iterator[Row], workers: int) -> None:
    """Record the missing bags of the flights selected by the campaign's file.

    The campaign's folder is locked by this process; ``rows`` are those of its table.
    """
    if flyer.study.keep.bag == "never":
        return
    bags = folder.absolute() / BAGS
    make_folder(bags)
    for unfinished in bags.glob(".*"):  # of a process that was killed
        shutil.rmtree(unfinished)
    tasks = [row.task for row in rows if _is_selected(flyer.study, row)]
    missing = [task for task in tasks if not (bags / bag_name(task)).exists()]
    with closing(run_many(BagFlyer(flyer, bags), missing, workers=workers)) as running:
        for done in running:
            if done.error is not None:
                raise InputError(f"{bags / bag_name(done.item)}: {done.error}")


def _is_selected(study: Study, row: Row) -> bool:
    if study.keep.bag == "on_failure" and row.is_complete:
        return not all(is_met(row, study.require, name) for name in study.require)
    return row.is_complete or row.outcome in (DIVERGED, UNANSWERED)
