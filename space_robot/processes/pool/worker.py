"""Worker process: calls the function with one item after the other."""

from __future__ import annotations

import ctypes
import gc
import os
import pickle
import signal
import traceback
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from typing import Any

from space_robot_msgs_py.config.text import one_line_of

from ..fork_server import Target, accept_signals
from ..memory import COLLECTED_AT

IGNORED = (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT)
"""Terminal signals, which only the parent process handles."""
PR_SET_PDEATHSIG = 1
"""Option of prctl(2): signal sent to a process when its parent ends."""


class WorkerTraceback(Exception):  # noqa: N818 - shown as the cause of an error, never raised
    """The traceback of an error that was raised in a worker."""

    def __str__(self) -> str:
        """Return the traceback as Python prints it."""
        return f"\n{self.args[0]}"


def worker_of(function: Callable[[Any], Any]) -> Target:
    """Return the function of a forked worker: `work` until its parent ends."""

    def run(connection: Connection, descriptors: Sequence[int], server: int) -> None:
        accept_signals(ignored=IGNORED)
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() == server:  # else it has ended before
            work(function, connection)

    return run


def work(function: Callable[[Any], Any], connection: Connection) -> None:
    """Answer every pickled item that comes, until the other end is closed.

    Args:
        function: called with the items.
        connection: brings items, takes answers, see `unpacked`.
    """
    # to look through what the modules hold, and a figure half drawn, costs a tenth of the time
    gc.freeze()
    gc.set_threshold(COLLECTED_AT)
    while True:
        try:
            item = connection.recv_bytes()
        except (EOFError, OSError):
            return
        try:
            connection.send_bytes(answer(function, item))
        except OSError:  # whoever wanted it has been killed
            return
        gc.collect(0)  # cycles that an item leaves, which may hold much memory, are in its youngest


def answer(function: Callable[[Any], Any], item: bytes) -> bytes:
    """Call the function with a pickled item and pickle its result, or its error."""
    try:
        return pickle.dumps((function(pickle.loads(item)), None, ""))
    except BaseException as error:  # SystemExit and KeyboardInterrupt are the function's, too
        text = traceback.format_exc()
        try:
            packed = pickle.dumps((None, as_exception(error), text))
            pickle.loads(packed)
        except Exception:  # an error that cannot travel: its text can
            packed = pickle.dumps((None, RuntimeError(one_line_of(error)), text))
        return packed


def as_exception(error: BaseException) -> Exception:
    """Return an error of a function, as a text if raising it would end the process."""
    return error if isinstance(error, Exception) else RuntimeError(one_line_of(error))


def unpacked(packed: bytes) -> tuple[Any, Exception | None]:
    """Return result and error of an `answer`; the error has its traceback as its cause."""
    try:
        result, error, text = pickle.loads(packed)
    except Exception as failure:  # a result that cannot be read again
        return None, failure
    return result, with_traceback(error, text)


def with_traceback(error: Exception | None, text: str) -> Exception | None:
    """Return an error from another process with its traceback, if it came with one, as cause."""
    if error is not None and text:
        error.__cause__ = WorkerTraceback(text)
    return error
