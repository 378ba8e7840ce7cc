"""Many items: the same comes of them here, in processes and on a cluster; no process is left."""

from __future__ import annotations

import faulthandler
import gc
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.processes.pool import OutOfTimeError, WorkerDiedError, cluster, run_many
from space_robot_msgs_py.errors import DivergedError, InputError


def reciprocal(number: float) -> float:
    return 1.0 / number


@settings(max_examples=10, deadline=None)
@given(st.lists(st.integers(-3, 3), max_size=20), st.integers(0, 3))
def test_every_item_is_done_once(numbers: list[int], workers: int) -> None:
    done = list(run_many(reciprocal, numbers, workers=workers))
    assert sorted(d.item for d in done) == sorted(numbers)
    for one in done:
        if one.item:
            assert one.result == 1.0 / one.item
            assert one.error is None
        else:
            assert one.result is None
            assert isinstance(one.error, ZeroDivisionError)
            assert not workers or "in reciprocal" in str(one.error.__cause__)


def end_somehow(how: str) -> str:
    match how:
        case "exit":
            os._exit(0)
        case "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        case "segfault":
            faulthandler.disable()  # pytest's, which would print all stacks
            os.kill(os.getpid(), signal.SIGSEGV)
        case "raise":
            raise DivergedError(7, 0.1, "too fast")
        case "sleep":
            time.sleep(60.0)
    return how


def test_workers_that_die_are_replaced() -> None:
    items = ["a", "exit", "b", "kill", "segfault", "c", *"defg"]
    done = {d.item: d for d in run_many(end_somehow, items, workers=2, attempts=2)}
    assert done.keys() == set(items)
    before = "its process died in each of 2 attempts, the last time "
    assert {item: str(d.error) for item, d in done.items() if d.error} == {
        "exit": before + "with exit code 0",
        "kill": before + "by SIGKILL",
        "segfault": before + "by SIGSEGV",
    }
    assert all(d.result == item for item, d in done.items() if not d.error)
    assert all(isinstance(d.error, (WorkerDiedError, type(None))) for d in done.values())


def test_an_item_is_out_of_time_by_itself() -> None:
    """What its worker was to go on with is done all the same."""
    done = list(run_many(end_somehow, ["a", "sleep", "b", "c"], timeout_s=0.4))
    assert [d.item for d in done] == ["a", "sleep", "b", "c"]
    assert [type(d.error) for d in done if d.error] == [OutOfTimeError]
    assert str(done[1].error) == "not over after 0.4 s"


@pytest.mark.parametrize(
    "options",
    [
        {"workers": -1},
        {"attempts": 0},
        {"timeout_s": 0.0},
        {"timeout_s": float("nan")},
        {"workers": 0, "timeout_s": 1.0},
    ],
)
def test_arguments_that_cannot_be(options: dict[str, int]) -> None:
    with pytest.raises(InputError):
        run_many(reciprocal, [1], **options)  # type: ignore[arg-type]


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


def wait_until_gone(pids: set[int]) -> None:
    deadline = time.monotonic() + 120.0
    while left := {pid for pid in pids if is_there(pid)}:
        assert time.monotonic() < deadline, left
        time.sleep(0.02)


def test_closing_the_iterator_leaves_nothing() -> None:
    running = run_many(lambda _: (os.getpid(), os.getppid()), range(100), workers=2)
    pids = {pid for _ in range(20) for pid in next(running).result or ()}
    assert len(pids) in (2, 3)
    running.close()
    assert not any(is_there(pid) for pid in pids)


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


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_workers_end_with_their_starter(
    starter: tuple[subprocess.Popen[str], set[int]], number: signal.Signals
) -> None:
    process, pids = starter
    process.send_signal(number)
    _, errors = process.communicate(timeout=20.0)
    wait_until_gone(pids)
    assert "BrokenPipe" not in errors


QUIET = {"host": "127.0.0.1", "dashboard_address": ":0", "silence_logs": "CRITICAL"}


def test_on_a_cluster_it_is_as_in_processes() -> None:
    """Of two Dask workers, processes that their nannies replace."""
    distributed = pytest.importorskip("distributed")
    items = ["raise", "kill", "sleep", *map(str, range(30))]
    options = {"timeout_s": 1.0, "attempts": 2}

    def told(**where: Any) -> list[tuple[str, str | None, str]]:
        done = run_many(end_somehow, items, **where, **options)
        return sorted((d.item, d.result, repr(d.error)) for d in done)

    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **QUIET) as dask:
        there = told(scheduler=dask.scheduler_address)
    assert there == told(workers=2)
    errors = {item: error.partition("(")[0] for item, _, error in there if error != "None"}
    assert errors == {
        "raise": "DivergedError",
        "kill": "WorkerDiedError",
        "sleep": "OutOfTimeError",
    }


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense"])
def test_a_scheduler_that_is_not_there(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "CONNECT_S", 0.5)
    with pytest.raises(InputError, match=f"scheduler '{address}': [^\n]+$") as error:
        run_many(reciprocal, [1], scheduler=address)
    clients = [each for each in gc.get_objects() if type(each) is distributed.Client]
    left = [each for each in clients if each.status != "closed"]
    assert not left, "it would close itself at any time, within a lock of Dask, too"
    assert error.value.__context__ is None


def test_without_dask_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"needs Dask: pip install 'distributed>=\d"):
        run_many(reciprocal, [1], scheduler="tcp://127.0.0.1:9")
