"""Fork server: forks preloaded child processes and reports their exit codes.

It has imported the modules and compiled kernels that they need, so that one begins within a few
milliseconds. A process with threads must not fork, since a lock that a thread holds stays locked in
the child; progress bars, notebooks, clusters and ROS run threads in the user's process. The server
of `multiprocessing` does not serve here: its children import the user's main module again, and it
looks for modules in the current folder.
"""

from __future__ import annotations

import os
import signal
import socket
import sys
import threading
import time
import traceback
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection

from space_robot_msgs_py.errors import SpaceRobotError
from space_robot_msgs_py.ros.process import clean_environment, module_command

from .interruption import SIGNALS

TIMEOUT_S = 60.0
"""Longest wait for an answer of the server, which normally takes milliseconds."""
CHECK_S = 5.0
"""Interval in which the server checks that its client process still runs."""
RUNS = b"-"
"""The exit code of a child that has not ended."""
MOST_DESCRIPTORS = 4
Target = Callable[[Connection, Sequence[int], int], None]
"""Function of a child: takes its connection to the client, open files, server pid."""


class ForkServer:
    """Client side of the fork server: forks children and ends them."""

    def __init__(self, start: Callable[[socket.socket, socket.socket], int]) -> None:
        """``start``: starts the server with its end of a socket, see `serve`; returns its pid.

        The other end, which the server must close if it has it, comes second.
        """
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._socket.settimeout(TIMEOUT_S)
        self._lock, self._has_forked = threading.Lock(), False
        with theirs:
            self._pid = start(theirs, self._socket)

    @classmethod
    def as_program(cls, module: str) -> ForkServer:
        """Start the server as a program; ``module`` calls `serve_standard_input`."""

        def start(theirs: socket.socket, ours: socket.socket) -> int:
            arguments = module_command(module)
            as_input = [(os.POSIX_SPAWN_DUP2, theirs.fileno(), 0)]
            return os.posix_spawn(
                arguments[0], arguments, clean_environment(), file_actions=as_input, setsid=True
            )

        return cls(start)

    def fork(self, *descriptors: int) -> tuple[int, Connection]:
        """Fork a child, which gets the open files, too; return its pid and the connection to it.

        Raises:
            ConnectionError: the server is gone.
            SpaceRobotError: there can be no more processes.
        """
        self._has_forked = True
        ours, theirs = Pipe()
        with theirs:
            pid = int(self._ask(b"fork", theirs.fileno(), *descriptors))
        if pid < 0:
            ours.close()
            raise SpaceRobotError(f"a process cannot be forked: {os.strerror(-pid)}")
        return pid, ours

    def exit_code(self, pid: int) -> int | None:
        """Return a child's exit code, below zero for a signal's number; None while it runs.

        Raises:
            OSError: the server is gone.
        """
        reply = self._ask(str(pid).encode())
        return None if reply == RUNS else int(reply)

    def close(self) -> None:
        """End the server and all its children."""
        with suppress(OSError):
            self._socket.send(b"quit")
        self._socket.close()
        with suppress(ChildProcessError):  # somebody else has waited for it
            if not self._has_forked:  # it may be busy with its modules
                os.kill(self._pid, signal.SIGKILL)
            deadline = time.monotonic() + CHECK_S
            while os.waitpid(self._pid, os.WNOHANG)[0] == 0:
                if time.monotonic() > deadline:
                    os.kill(self._pid, signal.SIGKILL)
                    os.waitpid(self._pid, 0)
                    break
                time.sleep(0.001)

    def _ask(self, request: bytes, *descriptors: int) -> bytes:
        with self._lock:
            socket.send_fds(self._socket, [request], descriptors)
            reply = self._socket.recv(64)
        if not reply:
            raise ConnectionResetError("the server of the processes has ended")
        return reply


def serve_standard_input(target: Target) -> None:
    """Run the server that `ForkServer.as_program` has started."""
    starter = os.getppid()
    with socket.socket(fileno=os.dup(0)) as end:
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        serve(end, target, starter)


def serve(end: socket.socket, target: Target, starter: int) -> None:
    """Fork and end children as asked, until the asking process closes its end or is gone.

    Asked to quit, it ends its children. If ``starter`` is gone they have to notice that.
    """
    end.settimeout(CHECK_S)
    accept_signals(ignored=SIGNALS)  # the starter ends this process
    children: dict[int, int | None] = {}
    while os.getppid() == starter:
        try:
            request, descriptors, _, _ = socket.recv_fds(end, 64, MOST_DESCRIPTORS)
        except TimeoutError:
            continue
        if not request:
            return
        if request == b"quit":
            break
        if request == b"fork":
            end.send(str(_forked_child(end, target, children, descriptors)).encode())
        else:
            code = _exit_code(children, int(request))
            end.send(RUNS if code is None else str(code).encode())
    for pid, code in children.items():
        if code is None:
            os.kill(pid, signal.SIGKILL)
            os.waitpid(pid, 0)


def _forked_child(
    end: socket.socket, target: Target, children: dict[int, int | None], descriptors: Sequence[int]
) -> int:
    def begin() -> None:
        end.close()
        target(Connection(descriptors[0]), descriptors[1:], server)

    server = os.getpid()
    try:
        pid = fork(begin)
    except OSError as error:
        return -(error.errno or 1)
    finally:
        for descriptor in descriptors:
            os.close(descriptor)
    children[pid] = None
    return pid


def _exit_code(children: dict[int, int | None], pid: int) -> int | None:
    if children[pid] is None:
        ended, status = os.waitpid(pid, os.WNOHANG)
        if ended:
            children[pid] = os.waitstatus_to_exitcode(status)
    return children[pid]


def fork(target: Callable[[], None]) -> int:
    """Fork a process that calls ``target`` and ends; return its pid.

    `SIGNALS` are blocked in it until `accept_signals`.
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
            target()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else int(end.code is not None)
            if isinstance(end.code, str):
                print(end.code, file=sys.stderr)
        except BaseException:
            traceback.print_exc()
        finally:
            with suppress(Exception):
                sys.stdout.flush()
                sys.stderr.flush()
            os._exit(code)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def accept_signals(ignored: Sequence[signal.Signals]) -> None:
    """In a forked process: end by `SIGNALS` but those that are ``ignored``."""
    for number in SIGNALS:
        signal.signal(number, signal.SIG_IGN if number in ignored else signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, SIGNALS)
