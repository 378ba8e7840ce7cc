"""Interface of a node's loop, which its host steps and which never waits itself.

So one host can run one node in a process, or step several in turn.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from .endpoints import RawPublisher, RawSubscription
from .health import Health


class Wait(NamedTuple):
    """The time and the messages that a loop waits for when it has nothing to do."""

    seconds: float
    """After this long it is to be stepped in any case."""
    inputs: tuple[RawSubscription, ...] = ()
    """It is to be stepped as soon as one of these has a message."""
    is_brief: bool = False
    """True if a message is expected at once, so that sleeping would cost more than looking."""
    is_for_others: bool = False
    """True if it only gives way to the other nodes: it is over once those of its own process, if
    there are any, have had their turns."""
    patience_s: float = 0.0
    """It may last so much longer while other nodes of the process have something to do."""


class Loop(Protocol):
    """A node's work; made with its settings in configure, stepped while the node is active."""

    @property
    def outputs(self) -> Sequence[RawPublisher]:
        """Topics that nobody else may publish."""

    @property
    def wait_for(self) -> Sequence[str]:
        """Who must listen before the first step: ``NODE:TOPIC``, or ``NODE`` to all ``outputs``."""

    @property
    def is_complete(self) -> bool:
        """True if the loop has come to its end, and with it the flight."""

    def begin(self) -> None:
        """Prepare for stepping; called on activate."""

    def step(self) -> Wait | None:
        """Run one step without waiting.

        Returns:
            What to wait for; None if something was done and there may be more.
        """

    def deactivate(self) -> None:
        """Leave the graph safe: called on deactivate, and before the end of an active node."""

    def close(self) -> None:
        """Release all resources; called on cleanup and at the end.

        Raises:
            FlightError: something that was promised has not been kept.
        """

    def health(self) -> Health:
        """Return the health of the node; called some times a second."""
