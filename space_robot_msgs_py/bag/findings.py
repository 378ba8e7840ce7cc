"""The faults of a bag that was read, in sentences."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from ..samples import Timebase
from ..topics import TRUTH

_STRETCHES = 3
SHOWN = 12
"""Names in a sentence."""


def some_of(names: Iterable[str]) -> str:
    """The first of some names, and how many there are more; a bag may have thousands."""
    there = list(names)
    more = f", and {len(there) - SHOWN:,} more" if len(there) > SHOWN else ""
    return ", ".join(there[:SHOWN]) + more


def missing_ticks(whole: NDArray[np.bool_], timebase: Timebase) -> list[str]:
    """Describe the ticks without state or reference; ``whole`` (N,) is true for others."""
    edges = np.diff(np.concatenate(([True], whole, [True])).astype(np.int8))
    starts, stops = np.flatnonzero(edges < 0), np.flatnonzero(edges > 0)
    if not len(starts):
        return []
    spans = [
        f"{timebase.stamp_ns(int(start)) / 1e9:.4f} to {timebase.stamp_ns(int(stop) - 1) / 1e9:.4f}"
        for start, stop in zip(starts[:_STRETCHES], stops, strict=False)
    ]
    more = (
        f" s, and {len(starts) - _STRETCHES} stretches more" if len(starts) > _STRETCHES else " s"
    )
    count = int(np.count_nonzero(~whole))
    return [f"{count} of {len(whole)} ticks lack state or reference: t = {', '.join(spans)}{more}"]


def unread_messages(recorded: Mapping[str, int], gone: Mapping[str, int]) -> list[str]:
    """Describe how many of the recorded messages could not be read."""
    if not gone:
        return []
    each = ", ".join(f"{name} {count}" for name, count in gone.items())
    return [
        f"{sum(gone.values())} of {sum(recorded.values())} recorded messages cannot be read: {each}"
    ]


def half_truth(counts: Mapping[str, int]) -> list[str]:
    """Return True if only one half of the true states exists, so that it is unusable."""
    there = [topic.full_name for topic in TRUTH if counts.get(topic.full_name)]
    if len(there) != 1:
        return []
    return [f"of the true states only {there[0]} is there: the measured ones are taken for them"]
