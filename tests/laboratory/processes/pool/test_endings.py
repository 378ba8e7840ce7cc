"""However a run of many ends, no process of it is left."""

from __future__ import annotations

import os
import pickle
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from multiprocessing import Pipe, get_context
from pathlib import Path

import pytest

from space_robot.processes.pool import run_many, worker

STARTER = """
import os, time
from space_robot.processes.pool import run_many, worker

def name(_):
    os.write(1, f"{os.getpid()} {os.getppid()}\\n".encode())
    time.sleep(600)

for done in run_many(name, range(4), workers=2):
    pass
"""


def is_there(pid: int) -> bool:
    """Whether a process runs; a zombie, which only waits to be asked for, does not."""
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except (FileNotFoundError, ProcessLookupError):
        return False
    return state != "Z"


def parent(pid: int) -> int:
    return int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[1])


def wait_until_gone(pids: set[int]) -> None:
    deadline = time.monotonic() + 20.0
    while left := {pid for pid in pids if is_there(pid)}:
        assert time.monotonic() < deadline, left
        time.sleep(0.02)


def test_closing_the_iterator_leaves_nothing() -> None:
    running = run_many(lambda _: (os.getpid(), os.getppid()), range(100), workers=2)
    pids = {pid for _ in range(20) for pid in next(running).result or ()}
    assert len(pids) in (2, 3)
    running.close()
    assert not any(is_there(pid) for pid in pids)


def test_an_iterator_that_never_began_leaves_nothing() -> None:
    def children() -> str:
        return Path(f"/proc/self/task/{os.getpid()}/children").read_text()

    before = children()
    running = run_many(abs, range(100))
    assert children() != before
    running.close()
    assert children() == before


@pytest.fixture
def starter() -> Iterator[tuple[subprocess.Popen[str], set[int]]]:
    """A process in whose two workers an item is, and the pids of these and of their server."""
    process = subprocess.Popen(
        [sys.executable, "-c", STARTER],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout is not None
    pids = {int(word) for _ in range(2) for word in process.stdout.readline().split()}
    assert len(pids) == 3
    yield process, pids
    process.kill()
    process.communicate()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_workers_end_with_their_starter(
    starter: tuple[subprocess.Popen[str], set[int]], number: signal.Signals
) -> None:
    process, pids = starter
    process.send_signal(number)
    _, errors = process.communicate(timeout=20.0)
    wait_until_gone(pids)
    assert "BrokenPipe" not in errors


def test_a_worker_whose_answer_nobody_wants_ends_in_silence() -> None:
    ours, theirs = Pipe()
    ours.send_bytes(pickle.dumps(1))
    ours.close()
    child = get_context("fork").Process(target=worker.work, args=(str, theirs))
    child.start()
    child.join()
    assert child.exitcode == 0


def test_ctrl_c_is_for_the_starter_alone(starter: tuple[subprocess.Popen[str], set[int]]) -> None:
    """The terminal sends it to all; only one of them says so."""
    process, pids = starter
    os.killpg(process.pid, signal.SIGINT)
    _, errors = process.communicate(timeout=20.0)
    assert errors.count("KeyboardInterrupt") == 1
    wait_until_gone(pids)


def test_workers_end_with_their_server(starter: tuple[subprocess.Popen[str], set[int]]) -> None:
    """Others take their place."""
    process, pids = starter
    (server,) = (pid for pid in pids if parent(pid) == process.pid)
    os.kill(server, signal.SIGKILL)
    wait_until_gone(pids)
    assert process.stdout is not None
    assert {int(word) for word in process.stdout.readline().split()}.isdisjoint(pids)
