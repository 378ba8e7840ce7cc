"""The processes that fly and draw side by side."""

from __future__ import annotations

import gc
import multiprocessing
import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager


@contextmanager
def processes(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """A pool of ``jobs`` forked processes; what is left to do is dropped if anything fails."""
    context = multiprocessing.get_context("fork")
    # what the modules hold stays: to look through it again and again costs a tenth of the time
    with ProcessPoolExecutor(jobs, mp_context=context, initializer=gc.freeze) as pool:
        try:
            yield pool
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0))
