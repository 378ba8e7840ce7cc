"""Bags of selected flights of a campaign: flown again, bit for bit, and recorded."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

from space_robot_msgs_py.errors import FlightError, InputError

from ...console.files import make_folder
from ...flight.ending import DIVERGED, UNANSWERED
from ...flight.simulate import fly_blocks
from ...processes.pool import run_many
from ..row.fly import RowFlyer
from ..row.row import Row, Task
from ..store.folder import BAGS
from ..store.journal import Journal
from ..study import Study
from .precision import is_met


@dataclass(frozen=True)
class BagFlyer:
    """Flies a task and records its bag."""

    flyer: RowFlyer
    folder: Path
    """Folder of the bags."""

    def __call__(self, task: Task) -> None:
        """Fly a task; the bag gets its final name once it is complete."""
        unfinished = self.folder / f".{bag_name(task)}"
        flight = self.flyer.draws.scenario(task.run, task.law).check()
        with closing(fly_blocks(flight, unfinished)) as blocks:
            try:
                for _ in blocks:
                    pass
            except FlightError:  # its row says so
                pass
        unfinished.rename(self.folder / bag_name(task))


def bag_name(task: Task) -> str:
    """Return the folder name of a task's bag, such as ``4711_tde_stc``."""
    return f"{task.run}_{re.sub(r'[^A-Za-z0-9_.=-]', '_', task.law)}"


def fly_bags(folder: Path, flyer: RowFlyer, journal: Journal, runs: int, workers: int) -> None:
    """Record the missing bags of the flights selected by the campaign's file.

    Args:
        folder: of the campaign, locked by this process.
        flyer: of the campaign's tasks.
        journal: with all rows.
        runs: number of runs in the table.
        workers: number of processes.

    Raises:
        InputError: a bag cannot be written.
    """
    if flyer.study.keep.bag == "never":
        return
    bags = folder.absolute() / BAGS
    make_folder(bags)
    for unfinished in bags.glob(".*"):  # of a process that was killed
        shutil.rmtree(unfinished)
    tasks = [
        task for task in _wanted(flyer.study, journal, runs) if not (bags / bag_name(task)).exists()
    ]
    if not tasks:
        return
    flown = run_many(BagFlyer(flyer, bags), tasks, workers=workers)
    with closing(flown) as done:
        for result in done:
            if result.error is not None:
                raise InputError(f"{bags / bag_name(result.item)}: {result.error}")


def _wanted(study: Study, journal: Journal, runs: int) -> Iterator[Task]:
    """Yield the tasks whose bags are requested; refused and killed flights have no bag."""
    for row in journal.rows(runs):
        has_flight = row.is_complete or row.outcome in (DIVERGED, UNANSWERED)
        if has_flight and (study.keep.bag == "always" or _has_failed(study, row)):
            yield row.task


def _has_failed(study: Study, row: Row) -> bool:
    """Return whether a flight ended early or missed a requirement."""
    return not (row.is_complete and all(is_met(row, study.require, name) for name in study.require))
