"""Real-time scheduling, where the system grants it."""

from __future__ import annotations

import os
from pathlib import Path


def ask_for_fifo(priority: int) -> str:
    """Put all threads of this process under SCHED_FIFO; return a message on the result.

    The middleware's threads go one above the loop: a loop that waits for a message must not keep
    the thread away that brings it. Linux wakes such threads at once, others when it suits.
    """
    loop = os.getpid()
    try:
        for entry in Path("/proc/self/task").iterdir():
            thread = int(entry.name)
            level = priority if thread == loop else priority + 1
            os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(level))
    except (OSError, AttributeError) as error:  # no permission; not Linux
        return f"SCHED_FIFO {priority} was not granted ({error}): the usual scheduling"
    return f"SCHED_FIFO {priority}"
