"""Outcome of an item: its result or its error."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar, cast

from space_robot_msgs_py.errors import SpaceRobotError

Item = TypeVar("Item")
Result = TypeVar("Result")


class WorkerDiedError(SpaceRobotError):
    """The process of an item died in every attempt."""


class OutOfTimeError(SpaceRobotError):
    """An item exceeded its time limit; its process was killed."""


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
