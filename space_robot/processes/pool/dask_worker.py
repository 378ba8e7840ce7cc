"""Run items on a Dask worker, in processes of its own.

So an item that crashes, hangs or ends its process does the same on a cluster as in processes, and
a Dask worker is lost only if somebody ends it.
"""

from __future__ import annotations

import threading
from typing import Any

from space_robot_msgs_py.errors import SpaceRobotError

from ..software import versions
from .processes import Pool

Versions = dict[str, str | None]
_pools: dict[tuple[str, int], Pool] = {}
"""By job and thread: a pool of one process for each thread."""


class OtherVersionsError(SpaceRobotError):
    """The software versions of a Dask worker differ from the client's."""


def run_there(
    job: str, function: bytes, item: Any, timeout_s: float | None, attempts: int, asked: Versions
) -> tuple[Any, Exception | None, str]:
    """Run an item in this thread's process; return its result, or its error with the traceback.

    Args:
        job: name of the run of many that the item is of; a thread's process stays for all of it.
        function: pickled.
        item: what the function is called with.
        timeout_s: see `run_many`.
        attempts: see `run_many`.
        asked: the client's versions.

    Raises:
        OtherVersionsError: there are others here.
    """
    from distributed.protocol.pickle import loads

    here = versions()
    for name, version in asked.items():
        if here.get(name) != version:
            raise OtherVersionsError(f"{name} is {here.get(name)} on a worker, {version} here")
    key = job, threading.get_ident()
    if key not in _pools:
        _pools[key] = Pool(1, loads(function), timeout_s, attempts)
    (done,) = _pools[key].run([item])
    return done.result, done.error, str(done.error.__cause__ or "") if done.error else ""


def release(job: str) -> None:
    """End the processes of a job, even if they are at an item."""
    for key in list(_pools):
        if key[0] == job:
            _pools.pop(key).close()
