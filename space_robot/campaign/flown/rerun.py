"""A flight of a campaign that was flown again."""

from __future__ import annotations

from collections.abc import Sequence

from ...api import FlownFlight
from ..row.row import Task


class Rerun(FlownFlight):
    """A `FlownFlight` that knows whether it is the one of the campaign's table."""

    def __init__(
        self,
        flown: FlownFlight,
        task: Task,
        digest: str,
        digest_of_row: str,
        other_software: Sequence[str],
    ) -> None:
        """Take the flight, what it is of, and its digest and that of the row.

        Args:
            flown: with its log.
            task: run and law.
            digest: of this flight.
            digest_of_row: of the table; empty if the row has no flight.
            other_software: what differs from the software that flew the campaign.
        """
        super().__init__(flown.flight, flown.ending, flown.bag, flown.log)
        self.task, self.digest, self.digest_of_row = task, digest, digest_of_row
        self._other_software = other_software

    @property
    def is_same(self) -> bool:
        """True if the flight has the digest of its row: then it is the same to the last bit."""
        return self.digest == self.digest_of_row

    @property
    def verdict(self) -> str:
        """What there is to say of that, in a line."""
        if self.is_same:
            return f"same digest as the row: {self.digest}"
        if not self.digest_of_row:
            return "the row has no digest: its flight was not flown to an end of its own"
        why = "; ".join(self._other_software) or "the software is the same: is the machine?"
        return f"digest {self.digest} differs from the row's {self.digest_of_row} ({why})"
