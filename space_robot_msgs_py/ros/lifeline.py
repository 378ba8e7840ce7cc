"""Lifelines: a child process ends when its parent ends, for any reason.

The parent holds the only write end of a pipe, which the kernel closes at its end, also after
SIGKILL; a thread of the child waits for that. The pipe of a node is its standard input, since
``ros2 run`` passes on neither signals nor other descriptors.
"""

from __future__ import annotations

import os
import signal
import threading
import time

VARIABLE = "SPACE_ROBOT_LIFELINE"
"""Environment variable: the standard input is a lifeline held by the process with this pid."""
TIMEOUT_S = 15.0
"""Time from SIGTERM to SIGKILL."""


def held() -> dict[str, str]:
    """Return the environment variable for a process whose standard input this process holds."""
    return {VARIABLE: str(os.getpid())}


def starter() -> int:
    """Return the pid of the process that holds this one's lifeline; 0 if there is none."""
    value = os.environ.get(VARIABLE, "")
    return int(value) if value.isdecimal() else 0


def hold_to_standard_input() -> None:
    """End this process with its parent, if standard input is a lifeline."""
    if starter():
        hold_to(0)


def hold_to(descriptor: int) -> None:
    """Send this process SIGTERM when the pipe's other end is closed, and later SIGKILL."""
    threading.Thread(target=_wait, args=(descriptor,), name="lifeline", daemon=True).start()


def _wait(descriptor: int) -> None:
    while os.read(descriptor, 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(TIMEOUT_S)
    os.kill(os.getpid(), signal.SIGKILL)
