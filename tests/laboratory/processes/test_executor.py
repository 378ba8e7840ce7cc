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

from space_robot.processes import executor
from space_robot.processes.executor import OutOfTimeError, WorkerDiedError, run_many
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
            for _ in range(600):  # on a cluster Python code is interrupted, not a call
                time.sleep(0.1)
    return how


def test_workers_that_die_are_replaced() -> None:
    items = ["a", "exit", "b", "kill", "segfault", "c", *"defg"]
    done = {d.item: d for d in run_many(end_somehow, items, workers=2)}
    assert done.keys() == set(items)
    died = {item for item, d in done.items() if isinstance(d.error, WorkerDiedError)}
    assert died == {"exit", "kill", "segfault"}
    assert all(d.result == item and not d.error for item, d in done.items() if item not in died)


def test_an_item_is_out_of_time_by_itself() -> None:
    """What its worker was to go on with is done all the same."""
    done = list(run_many(end_somehow, ["a", "sleep", "b", "c"], timeout_s=0.4))
    assert [d.item for d in done] == ["a", "sleep", "b", "c"]
    assert [type(d.error) for d in done if d.error] == [OutOfTimeError]
    assert str(done[1].error) == "not over after 0.4 s"


STARTER = """
import os, time
from space_robot.processes.executor import run_many
from tests.laboratory.processes.test_executor import name_itself

for done in run_many(name_itself, range(4), workers=2):
    pass
"""


def name_itself(_: int) -> None:
    os.write(1, f"{os.getpid()} {os.getppid()}\n".encode())
    time.sleep(600.0)


def own_pid(_: int) -> int:
    return os.getpid()


def test_closing_the_iterator_leaves_nothing() -> None:
    running = run_many(own_pid, range(100), workers=2)
    left = [psutil.Process(pid) for pid in {next(running).value() for _ in range(20)}]
    assert len(left) in (1, 2)
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
        _, errors = process.communicate(timeout=120.0)
    finally:
        process.kill()
    assert not psutil.wait_procs(left, 120.0)[1]
    assert "BrokenPipe" not in errors


QUIET = {"host": "127.0.0.1", "dashboard_address": ":0", "silence_logs": "CRITICAL"}


def test_on_a_cluster_it_is_as_in_processes() -> None:
    """Of two Dask workers, processes that their nannies replace, one is killed again and again.

    Dask gives an item to other workers as often as it allows failures by default.
    """
    distributed = pytest.importorskip("distributed")
    items = ["raise", "kill", *map(str, range(30))]

    def outcomes(**where: Any) -> list[tuple[str, str | None, str]]:
        done = [*run_many(end_somehow, items, **where)]
        done += run_many(end_somehow, ["sleep"], timeout_s=1.0, **where)
        return sorted((d.item, d.result, type(d.error).__name__) for d in done)

    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **QUIET) as cluster:
        there = outcomes(scheduler=cluster.scheduler_address)
    assert there == outcomes(workers=2)
    assert {item: error for item, _, error in there if error != "NoneType"} == {
        "raise": "DivergedError",
        "kill": "WorkerDiedError",
        "sleep": "OutOfTimeError",
    }


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense"])
def test_a_scheduler_that_is_not_there(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("distributed")
    monkeypatch.setattr(executor, "CONNECT_S", 0.5)
    with pytest.raises(InputError, match=f"scheduler '{address}': [^\n]+$"):
        list(run_many(reciprocal, [1], scheduler=address))


def test_without_dask_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"needs Dask: pip install 'distributed>=\d"):
        list(run_many(reciprocal, [1], scheduler="tcp://127.0.0.1:9"))
