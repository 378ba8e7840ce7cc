"""Signals that end a command, with cleanup and the exit code of a shell."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from space_robot_msgs_py.ros.process import clean_environment, lifeline

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)
QUIET_S = 2.0
"""Time in which a repeated signal, as from ``timeout``, must not disturb the cleanup."""


class Interrupted(KeyboardInterrupt):
    """The user has ended the command by a signal."""

    def __init__(self, number: int) -> None:
        """``number``: of the signal."""
        super().__init__(f"stopped by {signal.Signals(number).name}")
        self.number, self.exit_code = number, exit_code(number)


def exit_code(number: int) -> int:
    """Return a command's exit code after a signal, as shells tell it: 130 for SIGINT."""
    return 128 + number


@contextmanager
def raising_signals() -> Iterator[None]:
    """Raise `Interrupted` in the main thread on each of `SIGNALS`, within the context."""
    quiet_until = 0.0

    def raise_interrupted(number: int, frame: object) -> None:
        nonlocal quiet_until
        if (now := time.monotonic()) >= quiet_until:
            quiet_until = now + QUIET_S
            raise Interrupted(number)

    with handled_signals(raise_interrupted):
        yield


@contextmanager
def not_lost_in_callbacks() -> Iterator[None]:
    """Raise an `Interrupted` anew that a library written in C, as the compiler, has lost.

    Python prints and drops exceptions in callbacks of such libraries; an error of the library, a
    RuntimeError, may follow.
    """
    lost: Interrupted | None = None
    show_unraisable = sys.unraisablehook

    def keep(unraisable: Any) -> None:
        nonlocal lost
        if isinstance(unraisable.exc_value, Interrupted):
            lost = unraisable.exc_value
        else:
            show_unraisable(unraisable)

    sys.unraisablehook = keep
    try:
        yield
    except RuntimeError:
        if lost is None:
            raise
    finally:
        sys.unraisablehook = show_unraisable
    if lost is not None:
        raise lost


@contextmanager
def handled_signals(handler: Callable[[int, Any], None]) -> Iterator[None]:
    """Handle `SIGNALS` in the context, except a SIGHUP that is ignored (``nohup``)."""
    numbers = [
        number
        for number in SIGNALS
        if number != signal.SIGHUP or signal.getsignal(number) is not signal.SIG_IGN
    ]
    previous = {number: signal.signal(number, handler) for number in numbers}
    try:
        yield
    finally:
        for number, before in previous.items():
            signal.signal(number, before)


@contextmanager
def child_process(command: Sequence[str], **options: Any) -> Iterator[subprocess.Popen[bytes]]:
    """Start a process that ends with the context or this process; ``options``: of `Popen`.

    It must be one that holds to its standard input, see `hold_to_standard_input`.
    """
    environment = {**clean_environment(), **lifeline(), **options.pop("env", {})}
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, env=environment, start_new_session=True, **options
    ) as process:
        try:
            yield process
        finally:
            process.terminate()
