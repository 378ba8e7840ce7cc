"""Bags of the flights that a campaign's file selects."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from contextlib import closing, suppress
from dataclasses import dataclass
from pathlib import Path

from space_robot_msgs_py.errors import FlightError, InputError

from ...console.files import make_folder
from ...flight.ending import DIVERGED, UNANSWERED
from ...flight.simulate import simulate
from ...processes.executor import run_many
from ..row.fly import RowFlyer
from ..row.row import Row, Task
from ..store.store import BAGS
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
        flight = self.flyer.draws.flight(task.run, task.law)
        with suppress(FlightError):  # its row says so
            simulate(flight, unfinished)
        unfinished.rename(self.folder / bag_name(task))


def bag_name(task: Task) -> str:
    """Return the folder name of a task's bag, such as ``4711_tde_stc``."""
    return f"{task.run}_{re.sub(r'[^A-Za-z0-9_.=-]', '_', task.law)}"


def fly_bags(folder: Path, flyer: RowFlyer, rows: Iterator[Row], workers: int) -> None:
    """Record the missing bags of the flights selected by the campaign's file.

    Args:
        folder: of the campaign, locked by this process.
        flyer: of the campaign's tasks.
        rows: of the campaign's table.
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
    tasks = [row.task for row in rows if _is_selected(flyer.study, row)]
    missing = [task for task in tasks if not (bags / bag_name(task)).exists()]
    with closing(run_many(BagFlyer(flyer, bags), missing, workers=workers)) as running:
        for done in running:
            if done.error is not None:
                raise InputError(f"{bags / bag_name(done.item)}: {done.error}")


def _is_selected(study: Study, row: Row) -> bool:
    """Refused and killed flights have no bag."""
    if study.keep.bag == "on_failure" and row.is_complete:
        return not all(is_met(row, study.require, name) for name in study.require)
    return row.is_complete or row.outcome in (DIVERGED, UNANSWERED)
