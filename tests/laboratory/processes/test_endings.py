"""Processes and folders of ours: gone with who started them, however that ends, at any signal."""

from __future__ import annotations

import ctypes
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import psutil
import pytest
from forked import forked_server

from space_robot.processes.fork_server import ForkServer, accept_signals
from space_robot.processes.interruption import (
    Interrupted,
    child_process,
    not_lost_in_callbacks,
    raising_signals,
)
from space_robot.processes.scratch_folder import NEW_S, PREFIX, ScratchFolder

HELPER = [
    sys.executable,
    "-c",
    "import os, sys, time\n"
    "from space_robot_msgs_py.ros.process import hold_to_standard_input\n"
    "hold_to_standard_input()\n"
    "print(os.environ.get('EXTRA', ''), flush=True)\n"
    "time.sleep(600)\n",
]


STARTER = f"""
import subprocess, time
from space_robot.processes.interruption import child_process
with child_process({HELPER!r}, stdout=subprocess.PIPE) as helper:
    helper.stdout.readline()
    print(helper.pid, flush=True)
    time.sleep(600)
"""


def test_it_has_a_session_of_its_own_and_ends_with_the_context() -> None:
    with child_process(HELPER, stdout=subprocess.PIPE, env={"EXTRA": "beside"}) as helper:
        assert helper.stdout
        assert helper.stdout.readline() == b"beside\n"
        assert os.getsid(helper.pid) == os.getpgid(helper.pid) == helper.pid
        assert helper.poll() is None
    assert helper.returncode == -signal.SIGTERM


def test_it_does_not_outlive_a_starter_that_is_killed() -> None:
    starter = subprocess.Popen([sys.executable, "-c", STARTER], stdout=subprocess.PIPE)
    with starter:
        assert starter.stdout
        helper = psutil.Process(int(starter.stdout.readline()))
        starter.kill()
        helper.wait(60)
    assert not helper.is_running()


TIMEOUT_S = 240.0


def echo(connection: Connection, descriptors: Sequence[int], server: int) -> None:
    """Send back what comes, with the pids; end with a number that comes as exit code."""
    accept_signals(ignored=(signal.SIGINT,))
    while not isinstance(item := connection.recv(), int):
        for descriptor in descriptors:
            os.write(descriptor, str(item).encode())
        connection.send((item, os.getpid(), os.getppid(), server))
    raise SystemExit(item)


@pytest.fixture
def server() -> Iterator[ForkServer]:
    server = forked_server(echo)
    yield server
    server.close()


def test_children_talk_to_the_process_that_asked_for_them_and_end_with_the_server(
    server: ForkServer,
) -> None:
    (one, to_one), (two, to_two) = server.fork(), server.fork()
    for pid, connection in ((one, to_one), (two, to_two)):
        connection.send("word")
        item, own, parent, told = connection.recv()
        assert (item, own) == ("word", pid)
        assert parent == told != os.getpid()
    assert one != two
    assert server.exit_code(one) is None
    server.close()
    assert not any(psutil.pid_exists(pid) for pid in (one, two, parent))
    with pytest.raises(OSError, match="Bad file descriptor"):
        server.exit_code(one)


def test_a_child_gets_open_files_too(server: ForkServer) -> None:
    reading, writing = os.pipe()  # after the server, which has what was open before it
    _, connection = server.fork(writing, writing)
    os.close(writing)
    connection.send("twice ")
    connection.recv()
    assert os.read(reading, 100) == b"twice twice "
    connection.send(0)
    assert os.read(reading, 100) == b""  # nobody else holds it
    os.close(reading)


def test_the_exit_code_is_the_childs_and_stays(server: ForkServer) -> None:
    """Its signals come to it."""
    pid, connection = server.fork()
    connection.send("ready")
    connection.recv()
    os.kill(pid, signal.SIGINT)
    connection.send("still there")
    assert connection.recv()[0] == "still there"
    os.kill(pid, signal.SIGTERM)
    other, to_other = server.fork()
    to_other.send(3)
    for child, code in ((pid, -signal.SIGTERM), (other, 3)):
        until = time.monotonic() + TIMEOUT_S
        while server.exit_code(child) is None:
            assert time.monotonic() < until
            time.sleep(0.005)
        assert [server.exit_code(child), server.exit_code(child)] == [code] * 2
        assert not psutil.pid_exists(child)


def test_a_killed_server_is_an_error_not_a_hang(server: ForkServer) -> None:
    _, connection = server.fork()
    connection.send("who")
    *_, of_server = connection.recv()
    os.kill(of_server, signal.SIGKILL)
    with pytest.raises(ConnectionError):
        server.fork()
    connection.send(0)  # its child lives on, until it is asked to end


@pytest.mark.parametrize(
    ("number", "code"),
    [(signal.SIGHUP, 129), (signal.SIGINT, 130), (signal.SIGQUIT, 131), (signal.SIGTERM, 143)],
)
@pytest.mark.parametrize("default", [signal.SIG_DFL, signal.SIG_IGN])
def test_signals_are_raised_once_and_put_back(
    number: signal.Signals, code: int, default: signal.Handlers
) -> None:
    """Also where a shell ignores them for what it starts in the background."""
    original = signal.signal(number, default)
    try:
        with raising_signals():
            if number == signal.SIGHUP and default is signal.SIG_IGN:  # nohup
                assert signal.getsignal(number) is default
                return
            with pytest.raises(Interrupted, match=f"stopped by {number.name}") as raised:
                signal.raise_signal(number)
            signal.raise_signal(signal.SIGINT)  # again, from `timeout` or an impatient hand
        assert raised.value.exit_code == code
        assert signal.getsignal(number) is default
    finally:
        signal.signal(number, original)


@pytest.mark.parametrize("error", [None, RuntimeError("no compiled object yet")])
def test_a_signal_in_a_callback_of_c_is_raised_after_it(error: RuntimeError | None) -> None:
    @ctypes.CFUNCTYPE(None)
    def callback() -> None:
        signal.raise_signal(signal.SIGTERM)

    def compile_kernels() -> None:
        with not_lost_in_callbacks():
            callback()
            if error:
                raise error

    with raising_signals(), pytest.raises(Interrupted, match="stopped by SIGTERM"):
        compile_kernels()


@pytest.fixture(autouse=True)
def temporary(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def make_old(folder: Path) -> None:
    long_ago = time.time() - 2 * NEW_S
    os.utime(folder, (long_ago, long_ago))


def wait_for_the_end(end: Any) -> None:
    folder = ScratchFolder()
    (Path(folder.name) / "parameters.yaml").write_text("x")
    make_old(Path(folder.name))
    end.send(folder.name)
    time.sleep(600.0)


def test_the_folder_of_a_killed_process_goes_when_another_one_is_made() -> None:
    context = multiprocessing.get_context("fork")
    ours, theirs = context.Pipe()
    process = context.Process(target=wait_for_the_end, args=(theirs,), daemon=True)
    process.start()
    folder = Path(ours.recv())
    with ScratchFolder():
        assert folder.exists()  # it is in use
    os.kill(process.pid or 0, signal.SIGKILL)
    process.join()
    with ScratchFolder() as other:
        assert not folder.exists()
        assert Path(other).is_dir()
    assert not Path(other).exists()


def test_what_is_not_its_own_or_new_stays(temporary: Path) -> None:
    new, other, file, target = (
        temporary / name for name in (f"{PREFIX}new", "scratch", f"{PREFIX}file", "target")
    )
    for folder in (new, other, target):
        folder.mkdir()
    file.write_text("x")
    (temporary / f"{PREFIX}link").symlink_to(target)
    for path in (other, file, target):
        make_old(path)
    with ScratchFolder():
        pass
    assert all(path.exists() for path in (new, other, file, target))
