"""What comes of an item: its result, or the error in its place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar, cast

from space_robot_msgs_py.errors import SpaceRobotError

Item = TypeVar("Item")
Result = TypeVar("Result")


class WorkerDiedError(SpaceRobotError):
    """The process that was at an item ended, and did so in every attempt."""


class OutOfTimeError(SpaceRobotError):
    """An item took longer than it may; its process was killed."""


@dataclass(frozen=True)
class Done(Generic[Item, Result]):
    """An item that is over."""

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
