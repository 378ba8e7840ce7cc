"""A process that forks the workers, and ends them.

A process with threads must not fork: a lock that a thread holds stays locked in the child for good.
Workers that die are replaced while progress bars, notebooks and clusters run threads in the user's
process, so that one forks only once, at the beginning, a process that never has a thread. It knows
all modules and compiled kernels, and forks a worker from what it knows in a few milliseconds.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import time
import traceback
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from typing import Any

from space_robot_msgs_py.errors import SpaceRobotError

from ..interruption import SIGNALS
from .worker import work

TIMEOUT_S = 60.0
"""For an answer of the server, which takes milliseconds: then something is very wrong."""
CHECK_S = 5.0
"""Time between two looks of the server whether the process that it serves is still there."""
UNKNOWN = b"?"
"""The exit code of a worker that another server had forked."""


class ForkServer:
    """The server as the user's process sees it: it forks workers and ends them."""

    def __init__(self, function: Callable[[Any], Any]) -> None:
        """Fork the server; its workers call ``function``, which is not pickled."""
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.settimeout(TIMEOUT_S)
        self._pid = _fork(partial(_serve, theirs, self._socket, function, os.getpid()))
        theirs.close()

    def fork(self) -> tuple[int, Connection]:
        """Fork a worker and return its pid and the connection to it.

        Raises:
            ConnectionError: the server is gone.
            SpaceRobotError: there can be no more processes.
        """
        ours, theirs = Pipe()
        with theirs:
            pid = int(self._ask(b"fork", theirs.fileno()))
        if pid < 0:
            ours.close()
            raise SpaceRobotError(f"a worker cannot be forked: {os.strerror(-pid)}")
        return pid, ours

    def end(self, pid: int) -> int | None:
        """Kill a worker if it still runs; return its exit code, below zero for a signal's number.

        None: the server that forked it is gone, and the worker with it.
        """
        with suppress(OSError):
            reply = self._ask(f"end {pid}".encode())
            return None if reply == UNKNOWN else int(reply)
        return None

    def close(self) -> None:
        """End the server and all its workers."""
        with suppress(OSError):
            self._socket.send(b"quit")
        self._socket.close()
        with suppress(ChildProcessError):  # somebody else has waited for it
            deadline = time.monotonic() + CHECK_S
            while os.waitpid(self._pid, os.WNOHANG)[0] == 0:
                if time.monotonic() > deadline:
                    os.kill(self._pid, signal.SIGKILL)
                    os.waitpid(self._pid, 0)
                    break
                time.sleep(0.001)

    def _ask(self, request: bytes, *descriptors: int) -> bytes:
        socket.send_fds(self._socket, [request], descriptors)
        if not (reply := self._socket.recv(64)):
            raise ConnectionResetError("the server of the workers has ended")
        return reply


def _serve(
    end: socket.socket, other: socket.socket, function: Callable[[Any], Any], starter: int
) -> None:
    """Fork and end workers as asked, until the asking process closes its end or is gone."""
    other.close()
    end.settimeout(CHECK_S)
    for number in SIGNALS:  # the starter ends this process, which then leaves no worker behind
        signal.signal(number, signal.SIG_IGN)
    workers: set[int] = set()
    while os.getppid() == starter:
        try:
            request, descriptors, _, _ = socket.recv_fds(end, 64, 1)
        except TimeoutError:
            continue
        if request in (b"", b"quit"):
            break
        if request == b"fork":
            end.send(str(_forked_worker(end, function, workers, descriptors[0])).encode())
        else:
            pid = int(request.split()[1])
            end.send(str(_ended(pid)).encode() if pid in workers else UNKNOWN)
            workers.discard(pid)
    for pid in workers:
        _ended(pid)


def _forked_worker(
    end: socket.socket, function: Callable[[Any], Any], workers: set[int], descriptor: int
) -> int:
    """Return a new worker's pid, or the negative number of the system's error."""
    server = os.getpid()

    def begin() -> None:
        end.close()
        work(function, connection, server)

    try:
        with Connection(descriptor) as connection:
            pid = _fork(begin)
    except OSError as error:
        return -(error.errno or 1)
    workers.add(pid)
    return pid


def _ended(pid: int) -> int:
    """Kill a child, unless it has ended by itself, and return its exit code."""
    os.kill(pid, signal.SIGKILL)
    return os.waitstatus_to_exitcode(os.waitpid(pid, 0)[1])


def _fork(target: Callable[[], None]) -> int:
    """Fork a process that calls ``target`` and ends; return its pid.

    It ignores Ctrl-C, which is for the one that has started it all, and ends by other signals.
    """
    for stream in (sys.stdout, sys.stderr):  # else the child would write that, too
        with suppress(AttributeError, ValueError, OSError):
            stream.flush()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
    try:
        if pid := os.fork():
            return pid
        code = 1
        try:
            signal.signal(signal.SIGINT, signal.SIG_IGN)
            signal.signal(signal.SIGTERM, signal.SIG_DFL)
            if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # nohup
                signal.signal(signal.SIGHUP, signal.SIG_DFL)
            signal.pthread_sigmask(signal.SIG_SETMASK, before)
            target()
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            with suppress(Exception):
                sys.stdout.flush()
                sys.stderr.flush()
            os._exit(code)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
