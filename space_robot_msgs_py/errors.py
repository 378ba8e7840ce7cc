"""Exceptions that a user may meet; the command line shows their one line and exits."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any


class SpaceRobotError(Exception):
    """Base of this project's errors; the message says what was given, what is allowed, where."""

    exit_code = 1
    help_topic = ""
    """Topic of ``space-robot help`` that explains it; empty: none. The command line shows it."""

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle by what the error holds: its constructor may want other arguments."""
        return _remade, (type(self), self.args), self.__dict__


def _remade(kind: type[SpaceRobotError], args: tuple[Any, ...]) -> SpaceRobotError:
    return kind.__new__(kind, *args)  # an exception's `__new__` keeps them as `args`


@contextmanager
def explained_by(topic: str) -> Iterator[None]:
    """Set the `SpaceRobotError.help_topic` of errors that have none; also a decorator."""
    try:
        yield
    except SpaceRobotError as error:
        error.help_topic = error.help_topic or topic
        raise


class InputError(SpaceRobotError, ValueError):
    """Something the user gave cannot be used: exit code 2, nothing started."""

    exit_code = 2


class MessageError(SpaceRobotError, ValueError):
    """A message came that does not fit: other names, lengths or stamps than this graph's."""

    def __init__(self, text: str, reason: str = "malformed") -> None:
        """Take the text, and in ``reason`` the kind of misfit in a word."""
        super().__init__(text)
        self.reason = reason


class FlightError(SpaceRobotError):
    """A flight ended before its time."""

    log: Any = None
    """The `FlightLog` of what was flown until then, where somebody kept it."""


class DivergedError(FlightError):
    """The state left what any actuator could have brought about."""

    help_topic = "gains"

    def __init__(self, tick: int, period: float, why: str) -> None:
        super().__init__(f"the flight diverged at tick {tick} (t = {tick * period:.4f} s): {why}")
        self.tick = tick


class UnusableStateError(FlightError):
    """A measured state that no command can be computed from."""

    def __init__(self, tick: int, why: str, kind: str) -> None:
        """Take the tick, the reason, and in ``kind`` what is wrong in a word or two."""
        super().__init__(f"at tick {tick} {why}")
        self.tick, self.why, self.kind = tick, why, kind


class SingularAttitudeError(UnusableStateError):
    """The base is 180 degrees from its desired attitude, where J0 of (1) is singular."""

    def __init__(self, tick: int) -> None:
        why = (
            "the base is 180 degrees from its desired attitude, where J0 of eq. (1) is singular "
            "and no command exists"
        )
        super().__init__(tick, why, "attitude error near 180 degrees")
