"""Run a function over many items: in this process, in worker processes, or on a Dask cluster.

Each worker process is a `ProcessPoolExecutor` of its own, since the death of a worker breaks its
whole executor: so it is known whose item it was, and the items of others go on.
"""

from __future__ import annotations

import ctypes
import gc
import logging
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass
from itertools import islice
from multiprocessing import forkserver, resource_tracker
from typing import TYPE_CHECKING, Any, Generic, TypeVar, cast

from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.errors import InputError, SpaceRobotError

from . import COLLECTED_AT
from .software import versions

if TYPE_CHECKING:
    from distributed import Client

Item = TypeVar("Item")
Result = TypeVar("Result")

PRELOADED = ["space_robot.campaign.row.preloaded"]
"""Modules that the fork server imports, so that a worker begins within milliseconds."""
CONNECT_S = 5.0
"""Longest wait for an answer of a scheduler, s."""
WORKERS_S = 60.0
"""Longest time without a worker of a cluster, s."""
POLL_S = 1.0
"""Interval between checks of a cluster's workers, s."""


class WorkerDiedError(SpaceRobotError):
    """The process of an item died."""


class OutOfTimeError(SpaceRobotError):
    """An item exceeded its time limit."""


class ClusterError(SpaceRobotError):
    """The cluster cannot go on."""


@dataclass(frozen=True)
class Done(Generic[Item, Result]):
    """Outcome of a completed item."""

    item: Item
    result: Result | None
    """What the function returned; None if it did not."""
    error: Exception | None = None
    """What the function raised, a `WorkerDiedError` or an `OutOfTimeError`; else None."""

    def value(self) -> Result:
        """Return the result, or raise the error."""
        if self.error is not None:
            raise self.error
        return cast(Result, self.result)


def run_many(
    function: Callable[[Item], Result],
    items: Iterable[Item],
    *,
    workers: int = 1,
    scheduler: str | None = None,
    timeout_s: float | None = None,
) -> Generator[Done[Item, Result], None, None]:
    """Yield the outcome of every item, in order of completion.

    Closing the iterator ends the processes; whatever ends this process ends them, too. Items are
    taken as workers need them.

    Args:
        function: called with each item; both are pickled unless ``workers`` is 0.
        items: taken one after the other.
        workers: number of processes; 0: the function is called in this process.
        scheduler: address of a Dask scheduler, whose workers are used instead of ``workers``.
        timeout_s: longest time for an item; its process is then killed, on a cluster the function
            is interrupted as soon as it is in Python code.

    Raises:
        InputError: an argument is invalid, or the scheduler does not answer.
    """
    if workers < 0 or (timeout_s is not None and not timeout_s > 0.0):
        raise InputError(f"workers {workers}, timeout_s {timeout_s}: at least 0, above 0")
    if scheduler is not None:
        return _on_cluster(scheduler, function, items, timeout_s)
    if workers and is_daemonic():
        raise InputError(
            "a daemonic process, such as a worker of multiprocessing.Pool, cannot start processes: "
            "workers=0 flies in it"
        )
    if workers:
        return _in_processes(workers, function, iter(items), timeout_s)
    if timeout_s is None:
        return _in_this_process(function, items)
    raise InputError("timeout_s needs a worker: this process cannot be ended")


def run_all(
    function: Callable[[Item], Result],
    items: Sequence[Item],
    workers: int,
    progress: Callable[[int], Callable[[], None]] = lambda total: lambda: None,
) -> list[Result]:
    """Return the results of all items, hashable ones, in their order, or raise the first error.

    ``progress``: called with the number of items, gives what is called after each.
    """
    results = {}
    with closing(run_many(function, items, workers=workers)) as running:
        count = progress(len(items))
        for done in running:
            results[done.item] = done.value()
            count()
    return [results[item] for item in items]


def cores() -> int:
    """Return the number of processors that this process may use."""
    return len(os.sched_getaffinity(0))


def is_daemonic() -> bool:
    """Return True if this process cannot have children, as the workers of a Pool."""
    return multiprocessing.current_process().daemon


def as_exception(error: BaseException) -> Exception:
    """Return an error of a function, as a text if raising it would end the process."""
    return error if isinstance(error, Exception) else RuntimeError(one_line_of(error))


def _in_this_process(
    function: Callable[[Item], Result], items: Iterable[Item]
) -> Generator[Done[Item, Result], None, None]:
    for item in items:
        try:
            done = Done(item, function(item))
        except (Exception, SystemExit) as error:
            done = Done(item, None, as_exception(error))
        yield done


class _Worker:
    def __init__(self) -> None:
        start_fork_server()
        context = multiprocessing.get_context("forkserver")
        self._executor = ProcessPoolExecutor(1, context, _begin_worker)
        self._process: Any = None
        self.item: Any = None
        self.since = 0.0

    def submit(self, function: Callable[[Any], Any], item: Any) -> Future[Any]:
        if self._process is None:
            main = sys.modules["__main__"]  # which a new worker would run again
            sys.modules["__main__"] = type(sys)("__main__")
            try:
                ready = self._executor.submit(callable, function)  # imports the function's module
            finally:
                sys.modules["__main__"] = main
            (self._process,) = self._executor._processes.values()
            # else a worker that is killed while it writes leaves a reader that waits for ever
            self._executor._result_queue._writer.close()  # type: ignore[attr-defined]
            ready.result()  # the time of an item begins in a worker that has started
        self.item, self.since = item, time.monotonic()
        return self._executor.submit(function, item)

    def kill(self) -> None:
        for process in list((self._executor._processes or {}).values()):
            process.kill()  # also one that had just been started when Ctrl-C came
        self._executor.shutdown(cancel_futures=True)


def _submit(
    function: Callable[[Any], Any], item: Any, idle: list[_Worker]
) -> tuple[Future[Any], _Worker]:
    while True:
        worker = idle.pop() if idle else _Worker()
        with suppress(BrokenProcessPool):  # somebody has killed it while it had no item
            return worker.submit(function, item), worker
        worker.kill()


def start_fork_server() -> None:
    """Let the fork server import its modules now, while this process does something else."""
    multiprocessing.get_context("forkserver").set_forkserver_preload(PRELOADED)
    resource_tracker.ensure_running()  # first: its start ends the mask
    # inherited: Ctrl-C while it imports would end it with a traceback
    before = signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])
    try:
        forkserver.ensure_running()
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _forget_fork_server() -> None:
    """Let a forked child start a server of its own: it cannot wait for its parent's."""
    server: Any = forkserver._forkserver
    if server._forkserver_alive_fd is not None:
        os.close(server._forkserver_alive_fd)  # the parent's ends when the parent does
    server._forkserver_address = server._forkserver_alive_fd = server._forkserver_pid = None


os.register_at_fork(after_in_child=_forget_fork_server)


def _begin_worker() -> None:
    for number in (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):  # only the parent handles them
        signal.signal(number, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    # to search everything that the modules hold for cycles costs a tenth of the time
    gc.freeze()
    gc.set_threshold(COLLECTED_AT)


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os.kill(os.getpid(), signal.SIGKILL)


def _in_processes(
    size: int, function: Callable[[Any], Any], rest: Iterator[Any], timeout_s: float | None
) -> Generator[Done[Any, Any], None, None]:
    idle: list[_Worker] = []
    busy: dict[Future[Any], _Worker] = {}
    try:
        while True:
            for item in islice(rest, size - len(busy)):
                future, worker = _submit(function, item, idle)
                busy[future] = worker
            if not busy:
                return
            oldest = min(worker.since for worker in busy.values())
            left = None if timeout_s is None else max(0.0, oldest + timeout_s - time.monotonic())
            for future in wait(busy, left, FIRST_COMPLETED).done:
                worker, error = busy.pop(future), future.exception()
                if isinstance(error, BrokenProcessPool):
                    worker.kill()
                    yield Done(worker.item, None, WorkerDiedError("its process died"))
                    continue
                idle.append(worker)
                result = None if error else future.result()
                yield Done(worker.item, result, as_exception(error) if error else None)
            for future in [] if timeout_s is None else list(busy):
                if busy[future].since + cast(float, timeout_s) <= time.monotonic():
                    (worker := busy.pop(future)).kill()
                    late = OutOfTimeError(f"not over after {timeout_s:g} s")
                    yield Done(worker.item, None, late)
    finally:
        for worker in (*idle, *busy.values()):
            worker.kill()


def _on_cluster(
    address: str, function: Callable[[Any], Any], items: Iterable[Any], timeout_s: float | None
) -> Generator[Done[Any, Any], None, None]:
    rest, in_progress = iter(items), dict[Future[Any], Any]()
    lost = ClusterError(f"scheduler {address}: the connection to it is lost")
    task = _ClusterTask(function, timeout_s, versions())
    with connected(address) as client:
        from distributed import KilledWorker

        executor = client.get_executor(pure=False)
        seen = time.monotonic()
        try:
            while True:
                try:
                    threads = sum(client.nthreads().values())
                except (OSError, TimeoutError, RuntimeError, ValueError):
                    raise lost from None
                seen = time.monotonic() if threads else seen
                if time.monotonic() > seen + WORKERS_S:
                    raise ClusterError(f"scheduler {address}: no worker for {WORKERS_S:g} s")
                # none waits on a worker: Dask would blame it, too, for the death of that one
                for item in islice(rest, max(0, max(1, threads) - len(in_progress))):
                    in_progress[executor.submit(task, item)] = item
                if not in_progress:
                    return
                for future in wait(in_progress, POLL_S, FIRST_COMPLETED).done:
                    item = in_progress.pop(future)
                    try:
                        result, error = future.result()
                    except KilledWorker:
                        yield Done(item, None, WorkerDiedError("its Dask worker died"))
                        continue
                    except CancelledError:
                        raise lost from None
                    except Exception as failure:
                        is_own = isinstance(failure, SpaceRobotError)
                        text = str(failure) if is_own else one_line_of(failure)
                        raise ClusterError(f"scheduler {address}: {text}") from failure
                    yield Done(item, result, error)
        finally:
            if client.status == "running":
                executor.shutdown(wait=False)


class _TimeIsUpError(BaseException):
    """Not an `Exception`, which the interrupted function might take for its own."""


_one_at_a_time = threading.Lock()


@dataclass(frozen=True)
class _ClusterTask:
    function: Callable[[Any], Any]
    timeout_s: float | None
    versions: dict[str, str | None]

    def __call__(self, item: Any) -> tuple[Any, Exception | None]:
        for name, here in versions().items():
            if here != (there := self.versions.get(name)):
                raise SpaceRobotError(f"{name} is {here} on a worker, {there} here")
        with _one_at_a_time:
            try:
                with _interrupted_after(self.timeout_s):
                    return self.function(item), None
            except _TimeIsUpError:
                return None, OutOfTimeError(f"not over after {self.timeout_s:g} s")
            except (Exception, SystemExit) as error:
                return None, as_exception(error)


@contextmanager
def _interrupted_after(timeout_s: float | None) -> Iterator[None]:
    """Raise `_TimeIsUpError` in this thread, as soon as it is in Python code."""
    if timeout_s is None:
        yield
        return
    thread = ctypes.c_ulong(threading.get_ident())
    raised = ctypes.py_object(_TimeIsUpError)
    timer = threading.Timer(timeout_s, ctypes.pythonapi.PyThreadState_SetAsyncExc, (thread, raised))
    timer.start()
    try:
        yield
    finally:
        timer.cancel()
        timer.join()


@contextmanager
def connected(address: str) -> Iterator[Client]:
    """Connect to a scheduler; InputError: none answers at the address."""
    try:
        from distributed import Client
    except ImportError:
        raise InputError(f"a scheduler needs Dask: {install_command('dask')}") from None
    with _quiet():
        client, failure = None, ""
        try:
            client = Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, TimeoutError, ValueError, RuntimeError, TypeError) as error:
            failure = " ".join(str(error).split())
        if client is None:
            # a failed client closes itself when it is collected: later that might wait for ever
            gc.collect()
            raise InputError(f"scheduler {address!r}: {failure}")
        try:
            yield client
        finally:
            with suppress(TimeoutError):
                client.close(timeout=CONNECT_S)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep Dask from logging lost connections, which errors here tell; each logger has a level."""
    names = [name for name in logging.root.manager.loggerDict if name.startswith("distributed")]
    levels = {logger: logger.level for logger in map(logging.getLogger, names)}
    for logger in levels:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        yield
    finally:
        for logger, level in levels.items():
            logger.setLevel(level)
