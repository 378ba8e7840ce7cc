"""Available memory, and how often what is not used any more is searched for."""

from __future__ import annotations

import math
from pathlib import Path

COLLECTED_AT = 100_000
"""New objects after which Python searches for those that can be let go; by default 700."""


def available_bytes() -> float:
    """Return the memory available without swapping, in bytes, as Linux estimates it.

    Infinite where the estimate is not available.
    """
    try:
        lines = Path("/proc/meminfo").read_text("ascii").splitlines()
    except OSError:
        return math.inf
    kibibytes = next((line.split()[1] for line in lines if line.startswith("MemAvailable:")), "inf")
    return 1024.0 * float(kibibytes)
