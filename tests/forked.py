"""Programs forked from the test's node server, which has loaded what they need.

A `space-robot fly` that is started anew makes three seconds of imports and of reading compiled
kernels, its own and those of its node server, a node one and a half. Forked, they do the same from
their ``main()`` on. Tests of how a command begins start one anew, with `flights.COMMAND`.
"""

from __future__ import annotations

import os
import runpy
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Mapping, Sequence
from importlib import import_module
from pathlib import Path
from types import TracebackType
from typing import cast

from paths import TESTS

from space_robot.processes.fork_server import ForkServer, Target, fork, serve

ERRORS = "FORKED_STANDARD_ERROR"
"""In a command's environment: the inode of the pipe that takes its standard error."""
SPACE_ROBOT = "space-robot"
POLL_S = 0.005
END_S = 60.0
"""Longest wait for the end of a process that is killed, or is about to end."""


class Forked:
    """A program in a process of its own, with what tests use of `subprocess.Popen`.

    Its standard error goes where its standard output does, if ``stderr`` is None.
    """

    def __init__(
        self,
        module: str,
        arguments: Sequence[str],
        environment: Mapping[str, str],
        *,
        has_stderr: bool = False,
        folder: Path | None = None,
    ) -> None:
        """``folder``: where it is started (None: here)."""
        from space_robot.flight.graph.node_server import Program, node_server

        self._server = node_server()
        self.args, self.returncode = [module, *arguments], cast("int | None", None)
        pipes = [os.pipe() for _ in range(1 + has_stderr)]
        environment = dict(environment)
        if has_stderr:
            environment[ERRORS] = str(os.fstat(pipes[1][1]).st_ino)
        self.pid, self._connection = self._server.fork(*(theirs for _, theirs in pipes))
        for _, theirs in pipes:
            os.close(theirs)
        self.stdout, *others = (os.fdopen(ours, encoding="utf-8") for ours, _ in pipes)
        self.stderr = others[0] if others else None
        self._connection.send((Program(module, arguments), environment, str(folder or Path.cwd())))
        self._texts: dict[str, str] = {}
        self._readers: list[threading.Thread] = []

    @classmethod
    def of_command(
        cls, command: Sequence[str], environment: Mapping[str, str], folder: Path | None = None
    ) -> Forked:
        """A command: `space-robot` or a program's file, and the arguments."""
        paths = [str(TESTS), *filter(None, [environment.get("PYTHONPATH")])]
        searched = {**environment, "PYTHONPATH": os.pathsep.join(paths)}
        return cls(__name__, command, searched, has_stderr=True, folder=folder)

    def poll(self) -> int | None:
        """Its exit code, below zero for a signal's number; None while it runs."""
        if self.returncode is None:
            try:
                self.returncode = self._server.exit_code(self.pid)
            except OSError:  # somebody has killed the server
                self.returncode = -signal.SIGKILL
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for its end."""
        until = None if timeout is None else time.monotonic() + timeout
        while (code := self.poll()) is None:
            if until is not None and time.monotonic() > until:
                raise subprocess.TimeoutExpired(self.args, timeout or 0.0)
            time.sleep(POLL_S)
        return code

    def communicate(self, timeout: float | None = None) -> tuple[str, str]:
        """Wait for its end; what it has written, and to standard error."""
        until = None if timeout is None else time.monotonic() + timeout
        if not self._readers:
            for name in ("stdout", "stderr"):
                self._readers.append(threading.Thread(target=self._read, args=(name,), daemon=True))
                self._readers[-1].start()
        for reader in self._readers:
            reader.join(None if until is None else max(until - time.monotonic(), 0.0))
            if reader.is_alive():
                raise subprocess.TimeoutExpired(self.args, timeout or 0.0)
        self.wait(None if until is None else max(until - time.monotonic(), 0.0))
        self._connection.close()
        return self._texts["stdout"], self._texts["stderr"]

    def _read(self, name: str) -> None:
        file = getattr(self, name)
        self._texts[name] = file.read() if file and not file.closed else ""
        if file:
            file.close()

    def send_signal(self, number: int) -> None:
        if self.poll() is None:
            os.kill(self.pid, number)

    def terminate(self) -> None:
        self.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        self.send_signal(signal.SIGKILL)

    def __enter__(self) -> Forked:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if kind:  # it may wait for what the test has not come to
            self.kill()
        self.communicate(END_S)


def forked_server(target: Target) -> ForkServer:
    """Fork a server from this process."""

    def start(theirs: socket.socket, ours: socket.socket) -> int:
        def begin() -> None:
            ours.close()
            serve(theirs, target, starter)

        starter = os.getpid()
        return fork(begin)

    return ForkServer(start)


def main() -> None:
    """In the forked process: run the command or program that `Forked.of_command` asks for."""
    from setproctitle import setproctitle

    from space_robot.flight.graph.node_server import run_program

    _take_own_standard_error()
    streams = (os.fdopen(n, "w", encoding="utf-8", closefd=False) for n in (1, 2))
    sys.stdout, sys.stderr = streams
    signal.signal(signal.SIGINT, signal.default_int_handler)  # as in a Python just started
    _forget_the_tests_folder()
    setproctitle("space_robot: server of the nodes")
    servers = [forked_server(run_program)]  # all that a node needs is loaded
    setproctitle("space-robot")
    begun_anew = ForkServer.as_program
    ForkServer.as_program = lambda module: servers.pop() if servers else begun_anew(module)  # type: ignore[method-assign,assignment]
    server = servers[0]
    del sys.argv[0]
    try:
        if sys.argv[0] == SPACE_ROBOT:
            import_module("space_robot.cli.main").main()
        sys.path.insert(0, str(Path(sys.argv[0]).parent))
        runpy.run_path(sys.argv[0], run_name="__main__")
    finally:
        server.close()


def _take_own_standard_error() -> None:
    inode = int(os.environ.pop(ERRORS))
    for number in map(int, os.listdir("/proc/self/fd")):
        try:
            found = os.fstat(number).st_ino == inode
        except OSError:  # that of the listing
            continue
        if found:
            os.dup2(number, 2)
            os.close(number)
            return


def _forget_the_tests_folder() -> None:
    """It was searched for this module only."""
    first, _, others = os.environ.pop("PYTHONPATH").partition(os.pathsep)
    sys.path.remove(first)
    if others:
        os.environ["PYTHONPATH"] = others
