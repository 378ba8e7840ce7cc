"""Many items on a Dask cluster on this machine: what its workers' ends change, which is nothing."""

from __future__ import annotations

import gc
import logging
import os
import signal
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from space_robot.processes.pool import (
    Done,
    OutOfTimeError,
    WorkerDiedError,
    cluster,
    dask_worker,
    run_many,
)
from space_robot.processes.pool.cluster import ClusterError
from space_robot_msgs_py.errors import InputError

distributed = pytest.importorskip("distributed")
QUIET = {"host": "127.0.0.1", "dashboard_address": ":0", "silence_logs": "CRITICAL"}


@pytest.fixture(scope="module")
def dask() -> Iterator[Any]:
    """Two Dask workers, processes that their nannies replace."""
    with distributed.LocalCluster(n_workers=2, threads_per_worker=1, **QUIET) as running:
        yield running


def behave(item: tuple[str, int]) -> int:
    how, number = item
    match how:
        case "raise":
            return number // 0
        case "sleep":
            time.sleep(60.0)
        case "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        case "pid":
            time.sleep(0.05)
            return os.getpid()
    return number**2


def test_it_is_as_in_processes(dask: Any) -> None:
    items = [(how, n) for n, how in enumerate(("", "raise", "kill", "sleep", *[""] * 30))]

    def told(done: Iterator[Done[tuple[str, int], int]]) -> list[tuple[Any, ...]]:
        return sorted((d.item[1], d.result, repr(d.error)) for d in done)

    options = {"timeout_s": 1.0, "attempts": 2}
    there = told(run_many(behave, items, scheduler=dask.scheduler_address, **options))
    assert there == told(run_many(behave, items, workers=2, **options))
    assert [type(eval(error)) for _, _, error in there[1:4]] == [
        ZeroDivisionError,
        WorkerDiedError,
        OutOfTimeError,
    ]


def test_workers_may_be_killed_and_nothing_is_left(dask: Any) -> None:
    taken = iter([("pid", n) for n in range(30)])
    done = []
    for one in run_many(behave, taken, scheduler=dask.scheduler_address):
        done.append(one)
        if len(done) == 5:
            os.kill(dask.workers[0].pid, signal.SIGKILL)
    assert sorted(d.item[1] for d in done) == list(range(30))
    assert not any(d.error for d in done)
    deadline = time.monotonic() + 10.0
    while any(Path(f"/proc/{d.result}").exists() for d in done):
        assert time.monotonic() < deadline
        time.sleep(0.02)


def test_closing_the_iterator_ends_what_runs_there(dask: Any) -> None:
    items = [("pid", 0), *[("sleep", n) for n in range(10)]]
    running = run_many(behave, items, scheduler=dask.scheduler_address)
    pid = next(running).result
    started = time.monotonic()
    running.close()
    assert time.monotonic() - started < 20.0
    while Path(f"/proc/{pid}").exists():
        assert time.monotonic() < started + 20.0
        time.sleep(0.02)


def test_other_versions_are_refused(dask: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    found = {**cluster.versions(), "numpy": "0.1"}
    monkeypatch.setattr(cluster, "versions", lambda: found)
    with pytest.raises(ClusterError, match=r"numpy is \d\S+ on a worker, 0\.1 here"):
        list(run_many(behave, [("", 1)], scheduler=dask.scheduler_address))


def test_a_scheduler_that_goes_is_noticed(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """By one line: what Dask would log of it, with tracebacks, is left out, as long as it runs."""
    loggers = [logging.getLogger(f"distributed.{name}") for name in ("client", "core", "utils")]
    monkeypatch.setattr(loggers[0], "propagate", True)
    monkeypatch.setattr(cluster, "CONNECT_S", 2.0)
    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, protocol="tcp", **QUIET
    ) as local:
        running = run_many(behave, [("", 1), ("sleep", 2)], scheduler=local.scheduler_address)
        assert next(running).result == 1
        for logger in loggers:
            logger.critical("lost")
        assert "lost" not in caplog.messages
        dask_worker.release(next(iter(dask_worker._pools))[0])
        local.close()
        with pytest.raises(ClusterError, match="connection to it is lost"):
            list(running)
    assert all(logger.isEnabledFor(logging.CRITICAL) for logger in loggers)


def test_a_cluster_without_workers_is_not_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "WORKERS_S", 0.5)
    with (
        distributed.LocalCluster(n_workers=0, processes=False, protocol="tcp", **QUIET) as empty,
        pytest.raises(ClusterError, match=r"no worker for 0\.5 s"),
    ):
        list(run_many(behave, [("", 1)], scheduler=empty.scheduler_address))


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense", "foo://127.0.0.1:9"])
def test_a_scheduler_that_is_not_there(address: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cluster, "CONNECT_S", 0.5)
    with pytest.raises(InputError, match=f"scheduler '{address}': [^\n]+$") as error:
        run_many(behave, [("", 1)], scheduler=address)
    clients = [each for each in gc.get_objects() if type(each) is distributed.Client]
    left = [each for each in clients if each.status != "closed"]
    assert not left, "it would close itself at any time, within a lock of Dask, too"
    assert error.value.__context__ is None


def test_without_dask_it_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"needs Dask: pip install 'distributed>=\d"):
        run_many(behave, [("", 1)], scheduler="tcp://127.0.0.1:9")
