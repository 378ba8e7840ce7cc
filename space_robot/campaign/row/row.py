"""A row of a campaign's table: the result of one run under one law."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from ...flight.ending import COMPLETE

KILLED, OUT_OF_TIME, REFUSED = "killed", "out_of_time", "refused"
"""Outcomes beside those of `Ending`: the process died repeatedly; the time limit was exceeded;
the draw cannot be flown, for example an invalid robot."""
Value = float | str
"""Value of a variable."""


class Task(NamedTuple):
    """One flight of a campaign."""

    run: int
    law: str
    """As in the campaign's file: ``LAW`` or ``LAW=GAINS``."""


@dataclass(frozen=True, eq=False)
class Row:
    """Result of a flight; the mappings omit values that do not exist."""

    task: Task
    outcome: str
    reason: str = ""
    """Why the flight ended early, in a line; empty if it did not."""
    ended_at_s: float | None = None
    vary: Mapping[str, Value] = field(default_factory=dict)
    """Drawn values of the run, by variable."""
    metrics: Mapping[str, float] = field(default_factory=dict)
    require: Mapping[str, float] = field(default_factory=dict)
    """Metric of each requirement in its window."""
    bands: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    digest: str = ""
    """Digest from `digested`; empty if the flight was refused, killed or out of time."""

    @property
    def is_complete(self) -> bool:
        """True if the flight reached its planned end."""
        return self.outcome == COMPLETE

    @property
    def is_final(self) -> bool:
        """True if the result is reproducible; False if it may depend on the machine."""
        return self.outcome not in (KILLED, OUT_OF_TIME)

    def digested(self, state: bytes = b"") -> Self:
        """Return the row with its digest: 32 hexadecimal digits of SHA-256.

        It covers the bits of all numbers of the row (draws, end, metrics, requirements, bands) and
        of the true ``state`` at the flight's end, outcome and reason, but not run and law: flights
        with equal digests were equal.
        """
        digest = hashlib.sha256()
        for text in (self.outcome, self.reason):
            digest.update(text.encode() + b"\0")
        _take(digest, {"": np.nan if self.ended_at_s is None else self.ended_at_s})
        for part in (self.vary, self.metrics, self.require):
            _take(digest, part)
        for name, band in self.bands.items():
            digest.update(name.encode() + b"\0" + band.astype("<f4").tobytes())
        digest.update(state)
        return replace(self, digest=digest.hexdigest()[:32])


def _take(digest: hashlib._Hash, values: Mapping[str, Value]) -> None:
    for name, value in values.items():
        data = value.encode() if isinstance(value, str) else struct.pack("<d", value)
        digest.update(name.encode() + b"\0" + data + b"\0")
