"""A process that ends with the one that started it, however that one ends.

The starter holds the only write end of a pipe, which the kernel closes with it, be it by SIGKILL;
the started process has a thread that waits for that. The pipe of a node is its standard input: it
goes through ``ros2 run``, which neither passes signals on nor other descriptors.
"""

from __future__ import annotations

import os
import signal
import threading
import time

VARIABLE = "SPACE_ROBOT_LIFELINE"
"""In a process' environment: its standard input is a lifeline, held by the process of this pid."""
TIMEOUT_S = 15.0
"""For ending well after SIGTERM; then SIGKILL."""


def held() -> dict[str, str]:
    """Return what the environment of a process says whose standard input this process holds."""
    return {VARIABLE: str(os.getpid())}


def starter() -> int:
    """Pid of the process that holds the other end of this one's standard input; 0: none does."""
    value = os.environ.get(VARIABLE, "")
    return int(value) if value.isdecimal() else 0


def hold_to_standard_input() -> None:
    """End with the starter of this process, if it has said that it holds the other end."""
    if starter():
        hold_to(0)


def hold_to(descriptor: int) -> None:
    """Get SIGTERM when the pipe's other end is closed, and SIGKILL if that does not help."""
    threading.Thread(target=_wait, args=(descriptor,), name="lifeline", daemon=True).start()


def _wait(descriptor: int) -> None:
    while os.read(descriptor, 4096):
        pass
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(TIMEOUT_S)
    os.kill(os.getpid(), signal.SIGKILL)
