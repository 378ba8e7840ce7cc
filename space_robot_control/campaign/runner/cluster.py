"""Many items on a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any

from space_robot_msgs_py.errors import InputError


def on_cluster(
    address: str, function: Callable[[Any], Any], items: Iterable[Any], timeout_s: float | None,
    attempts: int,
) -> Iterator[Any]:  # fmt: skip
    """Yield None when all is ready, then what comes of every item; see `run_many`."""
    raise InputError("not yet")
    yield
