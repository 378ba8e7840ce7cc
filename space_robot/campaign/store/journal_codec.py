"""Format of a row in the journal, with a digest that is checked when it is read."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from ..row.row import Row, Task

Stored = tuple[int, int, str, str, bytes, str]
"""Run, number of the law, outcome, numbers, bands and digest of a row."""


class JournalCodec(NamedTuple):
    """Encodes and decodes the rows of one campaign."""

    campaign: str
    """`Manifest.campaign`: a row of another campaign does not decode."""
    laws: Sequence[str]
    """Laws of the campaign, in order."""

    def encode(self, row: Row) -> Stored:
        """Return a row in the stored format; JSON and the bands' bytes keep every digit."""
        numbers = json.dumps(
            {
                "reason": row.reason,
                "ended_at_s": row.ended_at_s,
                "vary": dict(row.vary),
                "metrics": dict(row.metrics),
                "require": dict(row.require),
                "digest": row.digest,
                "bands": {name: len(band) for name, band in row.bands.items()},
            }
        )
        bands = b"".join(band.astype("<f4").tobytes() for band in row.bands.values())
        law = list(self.laws).index(row.task.law)
        digest = self._digest(row.task, row.outcome, numbers, bands)
        return row.task.run, law, row.outcome, numbers, bands, digest

    def decode(self, stored: Sequence[Any]) -> Row | None:
        """Return a stored row; None if it is damaged or of another campaign."""
        run, law, outcome, numbers, bands, digest = stored
        kinds = int, int, str, str, bytes
        if not all(isinstance(v, kind) for v, kind in zip(stored, kinds, strict=False)):
            return None
        if not 0 <= law < len(self.laws):
            return None
        task = Task(run, self.laws[law])
        if digest != self._digest(task, outcome, numbers, bands):
            return None
        content: dict[str, Any] = json.loads(numbers)
        lengths: dict[str, int] = content.pop("bands")
        values = np.frombuffer(bands, "<f4")
        parts = np.split(values, np.cumsum(list(lengths.values()))[:-1]) if lengths else []
        return Row(task, outcome, bands=dict(zip(lengths, parts, strict=True)), **content)

    def _digest(self, task: Task, outcome: str, numbers: str, bands: bytes) -> str:
        texts = self.campaign, str(task.run), task.law, outcome, numbers
        head = b"".join(text.encode() + b"\0" for text in texts)
        return hashlib.sha256(head + bands).hexdigest()
