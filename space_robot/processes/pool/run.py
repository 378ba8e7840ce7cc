"""Run a function over many items, in processes or on a cluster."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from typing import Any

from space_robot_msgs_py.errors import InputError

from .cluster import on_cluster
from .done import Done, Item, Result
from .processes import in_processes
from .worker import as_exception


def run_many(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    *,
    workers: int = 1,
    scheduler: str | None = None,
    timeout_s: float | None = None,
    attempts: int = 3,
) -> Generator[Done[Item, Result], None, None]:
    """Yield the outcome of every item, in order of completion.

    Processes are forked, or the cluster is connected to, before this returns. Closing the iterator
    ends them; whatever ends this process ends them, too. Items are taken as workers need them: no
    more than two a worker are under way, so memory does not grow with their number.

    Args:
        function: what is called with each item. On a cluster it has to be picklable.
        items: taken one after the other; each has to be picklable unless ``workers`` is 0.
        workers: processes at work; 0: the function is called in this process.
        scheduler: address of a Dask scheduler, whose workers are used instead of ``workers``.
        timeout_s: longest time for an item, after which its process is killed (None: any).
        attempts: how often an item is tried whose process dies.

    Raises:
        InputError: an argument is invalid, or the scheduler does not answer.
    """
    if workers < 0 or attempts < 1 or (timeout_s is not None and not timeout_s > 0.0):
        raise InputError(
            f"workers {workers}, attempts {attempts}, timeout_s {timeout_s}: at least 0, at least "
            "1, above 0"
        )
    running: Generator[Any, None, None]
    if scheduler is not None:
        running = on_cluster(scheduler, function, items, timeout_s, attempts)
    elif workers:
        running = in_processes(workers, function, items, timeout_s, attempts)
    elif timeout_s is None:
        return _in_this_process(function, items)
    else:
        raise InputError("timeout_s needs a worker: this process cannot be ended")
    next(running)  # begins; what it yields first is no result
    return running


def run_all(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    workers: int,
    progress: Callable[[int], Callable[[], None]] = lambda total: lambda: None,
) -> list[Result]:
    """Return the results of all items in their order, or raise the first error.

    Args:
        function: see `run_many`.
        items: hashable and different ones.
        workers: see `run_many`.
        progress: called with the number of items, gives what is called after each.
    """
    results = {}
    with closing(run_many(function, items, workers=workers)) as running:
        done = progress(len(items))
        for one in running:
            results[one.item] = one.value()
            done()
    return [results[item] for item in items]


def _in_this_process(
    function: Callable[[Item], Result], items: Iterable[Item]
) -> Generator[Done[Item, Result], None, None]:
    for item in items:
        try:
            done = Done(item, function(item))
        except (Exception, SystemExit) as error:
            done = Done(item, None, as_exception(error))
        yield done


def cores() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0))
