"""Flies a sweep in processes side by side."""

from __future__ import annotations

from collections.abc import Callable

from ...processes.pool import run_all
from ..flown.preparation import Preparation
from ..row.row import Row, Task
from ..study import Study


def sweep(
    study: Study,
    seed: int = 0,
    jobs: int = 1,
    progress: Callable[[int], Callable[[], None]] = lambda total: lambda: None,
) -> list[Row]:
    """Fly every flight of a sweep to its row, by run, then by law.

    Args:
        study: see `sweep_study`.
        seed: of all draws; the rows depend on it and the study alone.
        jobs: processes at work.
        progress: called with the number of flights, gives what is called after each.

    Raises:
        InputError: an option that cannot be; nothing is flown then.
    """
    asked = Preparation.of(study, seed, None)
    asked.compile()
    tasks = [Task(run, law) for run in range(asked.runs) for law in study.laws]
    return run_all(asked.flyer, tasks, jobs, progress)
