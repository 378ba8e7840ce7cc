"""Run many items in worker processes.

Every worker has a pipe of its own, so a worker that is killed in the middle of a message spoils
nobody else's (pools with one queue for all, as in `concurrent.futures` and pebble, wait forever
then, or when a worker ends by ``os._exit(0)``). What is waited for, and how long:

* for results: until a pipe has one, or is closed, as the kernel does when the worker ends; and
  with ``timeout_s`` no longer than until an item's time is up;
* for the rest of a result, for room to send an item: `MESSAGE_S`, then the worker is killed;
* for the server that forks: `fork_server.TIMEOUT_S`.

Without ``timeout_s`` a function that never returns is waited for.
"""

from __future__ import annotations

import pickle
import signal
import socket
import struct
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from typing import Any

from ..fork_server import ForkServer
from .done import Done, OutOfTimeError, WorkerDiedError
from .worker import unpacked, worker_of

MESSAGE_S = 60
"""Longest time for a message once it has begun."""
SMALL = 32_768
"""Bytes of an item that a pipe takes without being read, so it can be sent ahead."""
Dones = Iterator[Done[Any, Any]]


@dataclass
class PoolTask:
    """An item in progress."""

    item: Any
    packed: bytes
    deaths: int = 0
    """Number of processes that have died while running the item."""


@dataclass
class Worker:
    """A worker process and its current and next tasks."""

    pid: int
    connection: Connection
    tasks: deque[PoolTask] = field(default_factory=deque)
    began: float = 0.0
    """Time when it began the first of its tasks."""


def in_processes(
    workers: int,
    function: Callable[[Any], Any],
    items: Iterable[Any],
    timeout_s: float | None,
    attempts: int,
) -> Generator[Any, None, None]:
    """Yield None when all is ready, then every outcome; see `run_many`."""
    pool = Pool(workers, function, timeout_s, attempts)
    try:
        yield
        yield from pool.run(items)
    finally:
        pool.close()


class Pool:
    """Pool of workers, forked on demand and replaced when they die."""

    def __init__(
        self, size: int, function: Callable[[Any], Any], timeout_s: float | None, attempts: int
    ) -> None:
        self._size, self._function = size, function
        self._timeout_s, self._attempts = timeout_s, attempts
        self._server = ForkServer.of_this_process(worker_of(function))
        self._workers: dict[Connection, Worker] = {}
        self._again: deque[PoolTask] = deque()
        """Tasks to assign again before any new item."""

    def run(self, items: Iterable[Any]) -> Dones:
        """Yield the outcome of every item, in order of completion."""
        rest = iter(items)
        while True:
            yield from self._give_out(rest)
            if not any(worker.tasks for worker in self._workers.values()):
                return
            yield from self._take_in()

    def close(self) -> None:
        """End all processes; another thread may be in `run`, which fails then."""
        self._server.close()

    def _give_out(self, rest: Iterator[Any]) -> Dones:
        """Assign a task to every idle worker, then a small one in advance."""
        for ahead in (0, 1):
            while (worker := self._free(ahead)) or (not ahead and len(self._workers) < self._size):
                if not self._again:
                    try:
                        item = next(rest)
                    except StopIteration:
                        return
                    try:
                        self._again.append(PoolTask(item, pickle.dumps(item)))
                    except Exception as error:  # one that cannot be pickled
                        yield Done(item, None, error)
                        continue
                if ahead and len(self._again[0].packed) > SMALL:
                    return
                self._send(worker or self._new_worker(), self._again.popleft())

    def _free(self, ahead: int) -> Worker | None:
        """Return a worker that has no more than ``ahead`` tasks."""
        return next((w for w in self._workers.values() if len(w.tasks) <= ahead), None)

    def _new_worker(self) -> Worker:
        try:
            pid, connection = self._server.fork()
        except ConnectionError:  # somebody killed the server, and with it all workers
            self._server.close()
            self._server = ForkServer.of_this_process(worker_of(self._function))
            pid, connection = self._server.fork()
        with _as_socket(connection) as end:
            for option in (socket.SO_RCVTIMEO, socket.SO_SNDTIMEO):
                end.setsockopt(socket.SOL_SOCKET, option, struct.pack("@ll", MESSAGE_S, 0))
        worker = self._workers[connection] = Worker(pid, connection)
        return worker

    def _send(self, worker: Worker, task: PoolTask) -> None:
        if not worker.tasks:
            worker.began = time.monotonic()
        worker.tasks.append(task)
        try:
            worker.connection.send_bytes(task.packed)
        except OSError:  # it has ended, or hangs: `_take_in` finds the pipe closed
            with suppress(OSError), _as_socket(worker.connection) as end:
                end.shutdown(socket.SHUT_RDWR)

    def _take_in(self) -> Dones:
        """Wait for completed tasks and yield their outcomes."""
        for connection in wait(list(self._workers), self._time_left()):
            assert isinstance(connection, Connection)
            yield from self._receive(self._workers[connection])
        if self._timeout_s is not None:
            latest = time.monotonic() - self._timeout_s
            for worker in list(self._workers.values()):
                if worker.tasks and worker.began <= latest and not worker.connection.poll():
                    self._remove(worker)
                    text = f"not over after {self._timeout_s:g} s"
                    yield Done(worker.tasks.popleft().item, None, OutOfTimeError(text))
                    self._again.extendleft(reversed(worker.tasks))

    def _time_left(self) -> float | None:
        """Return the time until the next item exceeds its limit (None: never)."""
        if self._timeout_s is None:
            return None
        began = min(worker.began for worker in self._workers.values() if worker.tasks)
        return max(0.0, began + self._timeout_s - time.monotonic())

    def _receive(self, worker: Worker) -> Dones:
        try:
            packed = worker.connection.recv_bytes()
        except (EOFError, OSError):
            yield from self._remove_dead_worker(worker)
            return
        task = worker.tasks.popleft()
        worker.began = time.monotonic()
        yield Done(task.item, *unpacked(packed))

    def _remove_dead_worker(self, worker: Worker) -> Dones:
        """Remove a worker that has died; its item is tried again, unless it was the last time."""
        code = self._remove(worker)
        if not worker.tasks:
            return
        worker.tasks[0].deaths += 1
        if worker.tasks[0].deaths == self._attempts:
            item = worker.tasks.popleft().item
            text = f"its process died in each of {self._attempts} attempts, {_manner(code)}"
            yield Done(item, None, WorkerDiedError(text))
        self._again.extendleft(reversed(worker.tasks))

    def _remove(self, worker: Worker) -> int | None:
        """Kill a worker if it runs, forget it and return its exit code, if that can be known."""
        code = self._server.end(worker.pid)
        del self._workers[worker.connection]
        worker.connection.close()
        return code


@contextmanager
def _as_socket(connection: Connection) -> Iterator[socket.socket]:
    """Return the socket of a connection."""
    end = socket.socket(fileno=connection.fileno())
    try:
        yield end
    finally:
        end.detach()


def _manner(code: int | None) -> str:
    """Describe how a process ended."""
    if code is None:
        return "the last time with the server of the workers"
    if code >= 0:
        return f"the last time with exit code {code}"
    return f"the last time by {signal.Signals(-code).name}"
