"""Many items: the same comes of them here, in processes and on a cluster; no process is left."""

from __future__ import annotations

import faulthandler
import os
import signal
import subprocess
import sys
import time
from typing import Any

import psutil
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


def test_closing_the_iterator_leaves_nothing() -> None:
    running = run_many(lambda _: (os.getpid(), os.getppid()), range(100), workers=2)
    pids = {pid for _ in range(20) for pid in next(running).result or ()}
    left = [psutil.Process(pid) for pid in pids]
    assert len(left) in (2, 3)
    running.close()
    assert not psutil.wait_procs(left, 120.0)[1]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_workers_end_with_their_starter(number: signal.Signals) -> None:
    """In each of two is an item; their server ends too."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    process = subprocess.Popen([sys.executable, "-c", STARTER], text=True, **pipes)
    try:
        assert process.stdout is not None
        pids = {int(word) for _ in range(2) for word in process.stdout.readline().split()}
        left = [psutil.Process(pid) for pid in pids]
        assert len(left) == 3
        process.send_signal(number)
        _, errors = process.communicate(timeout=20.0)
    finally:
        process.kill()
    assert not psutil.wait_procs(left, 120.0)[1]
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
    pytest.importorskip("distributed")
    monkeypatch.setattr(cluster, "CONNECT_S", 0.5)
    with pytest.raises(InputError, match=f"scheduler '{address}': [^\n]+$"):
        run_many(reciprocal, [1], scheduler=address)


def test_without_dask_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"needs Dask: pip install 'distributed>=\d"):
        run_many(reciprocal, [1], scheduler="tcp://127.0.0.1:9")
