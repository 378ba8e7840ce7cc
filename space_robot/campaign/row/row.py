"""Rows of a campaign's table, each the result of one run under one law, and its columns."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from space_robot_msgs_py.config.validation import StrictModel

from ...flight.ending import COMPLETE

if TYPE_CHECKING:
    from pandas import DataFrame

KILLED, OUT_OF_TIME, REFUSED = "killed", "out_of_time", "refused"
"""Outcomes in addition to those of `Ending`: the process died repeatedly; the time limit was
exceeded; the draw cannot be flown, for example an invalid robot."""
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
    warnings: str = ""
    """What should not be in a complete flight, such as ``limit cycle``, separated by "; "."""
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


class Columns(StrictModel):
    """The columns of a campaign's table, in order."""

    vary: dict[str, Literal["float64", "str"]]
    """Kind of each variable."""
    grid: dict[str, int]
    """Number of values of each grid variable."""
    metrics: list[str]
    require: list[str]
    bands: list[str]

    def table(self, rows: Iterable[Row]) -> DataFrame:
        """Return rows as a data frame: missing numbers are NaN, missing bands None."""
        import pandas

        rows = list(rows)
        table: dict[str, Any] = {
            "run": np.array([row.task.run for row in rows], np.int64),
            "law": [row.task.law for row in rows],
            "outcome": [row.outcome for row in rows],
            "reason": [row.reason for row in rows],
            "ended_at_s": np.array([row.ended_at_s for row in rows], float),
        }
        for name, kind in self.vary.items():
            values = [row.vary.get(name) for row in rows]
            is_text = kind == "str"
            table[f"vary.{name}"] = (
                [None if value is None else str(value) for value in values]
                if is_text
                else np.array(values, float)
            )
        for name in self.metrics:
            table[f"metric.{name}"] = np.array([row.metrics.get(name) for row in rows], float)
        for name in self.require:
            table[f"require.{name}"] = np.array([row.require.get(name) for row in rows], float)
        for name in self.bands:
            bands = [row.bands.get(name) for row in rows]
            table[f"band.{name}"] = pandas.Series(bands, dtype=object)
        table["warnings"] = [row.warnings for row in rows]
        return pandas.DataFrame(table | {"digest": [row.digest for row in rows]})
