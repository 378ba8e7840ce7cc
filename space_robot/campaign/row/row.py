"""A row of a campaign's table: what came of one run under one law."""

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
"""Outcomes beside those of `Ending`: the process that flew it died again and again; it flew for
longer than it may; the draw makes no flight, as a robot that cannot be."""
Value = float | str
"""Of a variable."""


class Task(NamedTuple):
    """One flight of a campaign."""

    run: int
    law: str
    """As the campaign's file has it: ``LAW`` or ``LAW=GAINS``."""


@dataclass(frozen=True, eq=False)
class Row:
    """What came of a flight; what there is not is left out of the mappings."""

    task: Task
    outcome: str
    reason: str = ""
    """Why it ended before its time, in a line; empty if it did not."""
    ended_at_s: float | None = None
    vary: Mapping[str, Value] = field(default_factory=dict)
    """The run's draws, by variable."""
    metrics: Mapping[str, float] = field(default_factory=dict)
    require: Mapping[str, float] = field(default_factory=dict)
    """The metric of each requirement in its window."""
    bands: Mapping[str, NDArray[np.float32]] = field(default_factory=dict)
    digest: str = ""
    """See `digested`; empty of a flight that was not flown to an end of its own."""

    @property
    def is_complete(self) -> bool:
        """True if the flight came to its planned end."""
        return self.outcome == COMPLETE

    @property
    def is_final(self) -> bool:
        """True if flying it again gives the same; else chance or the machine had a part in it."""
        return self.outcome not in (KILLED, OUT_OF_TIME)

    def digested(self, state: bytes = b"") -> Self:
        """Return the row with its digest: 32 hexadecimal digits of SHA-256.

        It covers the bits of all numbers of the row (draws, end, metrics, requirements, bands), of
        the true ``state`` at the flight's end, and outcome and reason. Run and law are left out:
        flights with equal digests were equal.
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
