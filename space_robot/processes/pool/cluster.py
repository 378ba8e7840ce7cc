"""Run many items on a Dask cluster.

What is waited for, and how long: for the scheduler `CONNECT_S`, when its connection is lost, too;
for workers `WORKERS_S`, at the beginning and when none is left. An item whose worker is lost is
given to another by the scheduler (until ``distributed.scheduler.allowed-failures``, 3).
"""

from __future__ import annotations

import gc
import itertools
import logging
import time
import uuid
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager, suppress
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.errors import InputError, SpaceRobotError

from ..software import versions
from .dask_worker import release, run_there
from .done import Done, WorkerDiedError
from .worker import with_traceback

if TYPE_CHECKING:
    from distributed import Client, Future

CONNECT_S = 5.0
"""Longest wait for an answer of the scheduler, s."""
WORKERS_S = 60.0
"""Longest time without a worker, s."""
LOOK_S = 1.0
"""Interval between checks of the number of workers, s."""
AHEAD = 2
"""Items in progress for each thread of the workers."""


class ClusterError(SpaceRobotError):
    """The cluster cannot go on."""


def on_cluster(
    address: str,
    function: Callable[[Any], Any],
    items: Iterable[Any],
    timeout_s: float | None,
    attempts: int,
) -> Generator[Any, None, None]:
    """Yield None when the scheduler answers, then every outcome; see `run_many`."""
    with _connected(address) as client:
        yield
        yield from _Job(client, address, function, timeout_s, attempts).run(items)


def check_scheduler(address: str) -> None:
    """Check that a scheduler answers at an address.

    Raises:
        InputError: there is none, or no client here.
    """
    with _connected(address):
        pass


class _Job:
    """A run of many items on a cluster."""

    def __init__(
        self,
        client: Client,
        address: str,
        function: Callable[[Any], Any],
        timeout_s: float | None,
        attempts: int,
    ) -> None:
        from distributed.protocol.pickle import dumps

        self._client, self._address, self._name = client, address, uuid.uuid4().hex
        self._function = dumps(function)
        self._options = timeout_s, attempts, versions()
        self._under_way: dict[Future[Any], Any] = {}
        """Items by what their results come with."""
        self._over: SimpleQueue[Future[Any]] = SimpleQueue()
        self._threads, self._looked, self._seen = 0, float("-inf"), time.monotonic()

    def run(self, items: Iterable[Any]) -> Iterator[Done[Any, Any]]:
        """Yield the outcome of every item, in order of completion."""
        rest = iter(items)
        try:
            while True:
                self._look()
                room = AHEAD * max(1, self._threads) - len(self._under_way)
                for item in itertools.islice(rest, max(0, room)):
                    self._submit(item)
                if not self._under_way:
                    return
                with suppress(Empty):
                    future = self._over.get(timeout=LOOK_S)
                    if done := self._done(future):
                        yield done
        finally:
            self._leave()

    def _submit(self, item: Any) -> None:
        future = self._client.submit(
            run_there, self._name, self._function, item, *self._options, pure=False
        )
        self._under_way[future] = item
        future.add_done_callback(self._over.put)

    def _look(self) -> None:
        """Count the workers' threads; check that the scheduler answers and has workers."""
        now = time.monotonic()
        if now < self._looked + LOOK_S:
            return
        self._looked = now
        try:
            self._threads = sum(self._client.nthreads().values())
        except (OSError, TimeoutError, RuntimeError, ValueError):
            raise self._gone() from None
        if self._threads:
            self._seen = now
        elif now > self._seen + WORKERS_S:
            raise ClusterError(f"scheduler {self._address}: no worker for {WORKERS_S:g} s")

    def _done(self, future: Future[Any]) -> Done[Any, Any] | None:
        """Return the outcome of an item; None: it was lost and will come again."""
        from distributed import KilledWorker

        if future.cancelled():
            raise self._gone()
        item = self._under_way[future]
        try:
            result, error, text = future.result(timeout=CONNECT_S)
        except TimeoutError:  # its worker has gone before it handed the result over
            self._over.put(future)
            return None
        except KilledWorker as killed:
            died = f"its Dask worker died in each of {killed.allowed_failures + 1} attempts"
            result, error, text = None, WorkerDiedError(died), ""
        except Exception as failure:  # not the function's: that one comes as a result
            if future.cancelled():
                raise self._gone() from None
            kind = f"{type(failure).__name__}: " * (not isinstance(failure, SpaceRobotError))
            raise ClusterError(f"scheduler {self._address}: {kind}{_line(failure)}") from failure
        del self._under_way[future]
        return Done(item, result, with_traceback(error, text))

    def _gone(self) -> ClusterError:
        return ClusterError(f"scheduler {self._address}: the connection to it is lost")

    def _leave(self) -> None:
        """Cancel items in progress and end the processes of this job."""
        if self._client.status == "running":
            with suppress(Exception):
                self._client.cancel(list(self._under_way), force=True)
                self._client.run(release, self._name, on_error="ignore", wait=True)


@contextmanager
def _connected(address: str) -> Iterator[Client]:
    """Return a client of the scheduler at an address.

    Raises:
        InputError: there is none, or no client here.
    """
    try:
        from distributed import Client
    except ImportError:
        raise InputError(f"a scheduler needs Dask: {install_command('dask')}") from None
    with _quiet():
        client, failure = None, ""
        try:
            client = Client(address, timeout=CONNECT_S, set_as_default=False)
        except (OSError, TimeoutError, ValueError, RuntimeError, TypeError) as error:
            failure = _line(error)
        if client is None:
            # a client that has failed closes itself when it is collected: now, for where Dask
            # holds its lock of event loops that would wait for ever
            gc.collect()
            raise InputError(f"scheduler {address!r}: {failure}")
        try:
            yield client
        finally:
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


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())
