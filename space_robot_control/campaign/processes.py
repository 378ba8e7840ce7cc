"""The processes that fly and draw side by side."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager

from space_robot_msgs_py.ros.lifeline import hold_to


@contextmanager
def processes(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Fork a pool of ``jobs`` processes, none of which outlives the context or this process.

    If anything fails, or the user ends the command, what they are at is dropped.
    """
    context = multiprocessing.get_context("fork")
    pipe = os.pipe()
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin, initargs=pipe)
    try:
        yield pool
    except BaseException:
        pool.shutdown(wait=False, cancel_futures=True)
        for worker in multiprocessing.active_children():
            worker.kill()
        raise
    finally:
        pool.shutdown()
        for end in pipe:
            os.close(end)


def _begin(read_end: int, write_end: int) -> None:
    """Make a forked process a worker."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is for the one that started us
    for number in (signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
    os.close(write_end)
    hold_to(read_end)
    # to look through what the modules hold, and a figure half drawn, costs a tenth of the time
    gc.freeze()
    gc.set_threshold(100_000)


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0))
