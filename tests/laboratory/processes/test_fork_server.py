"""A process that forks others from what it knows."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from multiprocessing.connection import Connection

import psutil
import pytest

from space_robot.processes.fork_server import ForkServer, Target, accept_signals

TIMEOUT_S = 20.0


def echo(connection: Connection, descriptors: Sequence[int], server: int) -> None:
    """Send back what comes, with the pids; end with a number that comes as exit code."""
    accept_signals(ignored=(signal.SIGINT,))
    while not isinstance(item := connection.recv(), int):
        for descriptor in descriptors:
            os.write(descriptor, str(item).encode())
        connection.send((item, os.getpid(), os.getppid(), server))
    raise SystemExit(item)


@contextmanager
def served(target: Target = echo) -> Iterator[ForkServer]:
    server = ForkServer.of_this_process(target)
    try:
        yield server
    finally:
        server.close()


def wait_for(condition: Callable[[], bool]) -> None:
    until = time.monotonic() + TIMEOUT_S
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.005)


def test_a_child_talks_to_the_process_that_asked_for_it() -> None:
    with served() as server:
        (one, to_one), (two, to_two) = server.fork(), server.fork()
        for pid, connection in ((one, to_one), (two, to_two)):
            connection.send("word")
            item, own, parent, told = connection.recv()
            assert (item, own) == ("word", pid)
            assert parent == told != os.getpid()
        assert one != two
        assert server.exit_code(one) is None


def test_a_child_gets_open_files_too() -> None:
    with served() as server:
        reading, writing = os.pipe()  # after the server, which has what was open before it
        _, connection = server.fork(writing, writing)
        os.close(writing)
        connection.send("twice ")
        connection.recv()
        assert os.read(reading, 100) == b"twice twice "
        connection.send(0)
        assert os.read(reading, 100) == b""  # nobody else holds it
    os.close(reading)


@pytest.mark.parametrize("code", [0, 3])
def test_the_exit_code_is_the_childs_and_stays(code: int) -> None:
    with served() as server:
        pid, connection = server.fork()
        connection.send(code)
        wait_for(lambda: server.exit_code(pid) is not None)
        assert [server.exit_code(pid), server.exit_code(pid), server.end(pid)] == [code] * 3
        assert not psutil.pid_exists(pid)


def test_a_child_that_raises_has_exit_code_1(capfd: pytest.CaptureFixture[str]) -> None:
    def fail(connection: Connection, descriptors: Sequence[int], server: int) -> None:
        raise ValueError("of no use")

    with served(fail) as server:
        pid, _ = server.fork()
        wait_for(lambda: server.exit_code(pid) is not None)
        assert server.exit_code(pid) == 1
    assert "ValueError: of no use" in capfd.readouterr().err


def test_signals_of_a_child() -> None:
    with served() as server:
        pid, connection = server.fork()
        connection.send("ready")
        connection.recv()
        os.kill(pid, signal.SIGINT)
        connection.send("still there")
        assert connection.recv()[0] == "still there"
        os.kill(pid, signal.SIGTERM)
        wait_for(lambda: server.exit_code(pid) == -signal.SIGTERM)


def test_ending_a_child_kills_it() -> None:
    with served() as server:
        pid, _ = server.fork()
        assert server.end(pid) == -signal.SIGKILL
        assert not psutil.pid_exists(pid)
        assert server.end(1) is None  # none of its children


def test_signals_of_the_terminal_do_not_end_the_server() -> None:
    with served() as server:
        _, connection = server.fork()
        connection.send("who")
        *_, pid = connection.recv()
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            os.kill(pid, number)
        server.fork()[1].close()


def test_closing_ends_server_and_children() -> None:
    with served() as server:
        pid, connection = server.fork()
        connection.send("who")
        *_, of_server = connection.recv()
    assert not psutil.pid_exists(pid)
    assert not psutil.pid_exists(of_server)
    with pytest.raises(OSError, match="Bad file descriptor"):
        server.exit_code(pid)
    assert server.end(pid) is None


def test_a_killed_server_is_an_error_not_a_hang() -> None:
    with served() as server:
        pid, connection = server.fork()
        connection.send("who")
        *_, of_server = connection.recv()
        os.kill(of_server, signal.SIGKILL)
        with pytest.raises(ConnectionError):
            server.fork()
        assert server.end(pid) is None
        connection.send(0)  # its child lives on, until it is asked to end


def test_a_module_is_a_server_in_a_session_of_its_own() -> None:
    server = ForkServer.of_module("space_robot.flight.graph.node_server")
    try:
        child = next(p for p in psutil.Process().children() if p.pid == server._pid)
        assert os.getsid(child.pid) == child.pid
    finally:
        server.close()  # though it still loads
    assert not psutil.pid_exists(child.pid)
